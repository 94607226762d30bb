"""Which grade biases and scale factors make likely."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.calibration.grade_evidence import GradeShown
from fieldcal.core.grade import Grade

USUAL = {
    "acc_bias": np.zeros(3), "acc_scale": np.ones(3),
    "gyr_bias": np.zeros(3), "gyr_scale": np.ones(3),
}  # fmt: skip
NAMES = ("acc_bias.x", "acc_scale.x", "gyr_bias.z", "angle_offset.alpha0_deg")


def shown(stated: Grade, *values: float, sigma: float = 1e-6) -> GradeShown:
    """Of the parameters above, in this order."""
    return GradeShown.of(
        stated, NAMES, np.array([*values, 7.0]), np.full(4, sigma), USUAL
    )


@pytest.mark.parametrize(
    ("stated", "values", "grade", "says"),
    [
        ("tactical", (0.34, 1.0119, -0.0209), "tactical", ""),
        ("tactical", (-0.36, 1.0, 0.0), "consumer", "acc_bias.x is -0.36 m/s²"),
        ("tactical", (0.0, 0.98, 0.0), "consumer", "acc_scale.x is -0.02 from"),
        ("tactical", (0.0, 1.0, 0.03), "consumer", "gyr_bias.z is +0.03 rad/s"),
        ("navigation", (0.02, 1.0, 0.0), "tactical", "more than 0.012 m/s²"),
        ("navigation", (0.5, 1.0, 0.0), "consumer", "acc_bias.x is +0.5 m/s²"),
        ("consumer", (2.0, 1.0, 0.0), "consumer", ""),
    ],
)
def test_what_no_unit_of_a_grade_has_makes_it_a_coarser_one(
    stated: Grade, values: tuple[float, ...], grade: Grade, says: str
) -> None:
    found = shown(stated, *values)
    assert found.grade == grade
    assert says in found.because and bool(found.because) == bool(says)


def test_what_is_hardly_known_says_nothing() -> None:
    assert shown("tactical", 0.5, 1.0, 0.0, sigma=0.1).because == ""


def test_outputs_in_counts_are_compared_in_their_units() -> None:
    counts = {**USUAL, "acc_scale": np.full(3, 1000.0)}

    def of(bias: float) -> str:
        values, sigma = np.array([bias]), np.array([1.0])
        return GradeShown.of("tactical", NAMES[:1], values, sigma, counts).because

    assert of(340.0) == "" and "+0.4 m/s²" in of(400.0)
