"""Which variants stand for all of them."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.solve.variants import REPRESENTATIVE_POINTS, choice_at, spread_points


def test_rounding_does_not_decide_between_variants_that_mirror_one_another() -> None:
    """Half of the probability ends between the second and the third."""
    rng = np.random.default_rng(1)
    weight = np.array([0.3, 0.2, 0.2, 0.3])
    for _ in range(100):
        rounded = weight * (1 + 1e-13 * rng.standard_normal(4))
        assert choice_at(rounded / rounded.sum(), 0.5) == 1


@pytest.mark.parametrize("weight", [[1.0], [0.5, 0.5], [0.25, 0.25, 0.125, 0.375]])
def test_each_is_reached_as_often_as_it_is_likely(weight: list[float]) -> None:
    (points,) = spread_points(1).T
    at = [choice_at(np.array(weight), float(u)) for u in points]
    share = np.bincount(at, minlength=len(weight)) / REPRESENTATIVE_POINTS
    np.testing.assert_allclose(share, weight, atol=1e-12)
