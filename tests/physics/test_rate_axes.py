"""Turned axes of gyroscopes, against turns that scipy makes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array
from fieldcal.physics.rate_axes import ObservedTurn, axes_by_turns, signed_axes


def turned(axes: Array, rng: np.random.Generator, count: int = 6) -> list[ObservedTurn]:
    """Turns of a device whose gyroscopes put out axes^T w."""
    out = []
    for _ in range(count):
        steps = rng.normal(0, 0.03, (40, 3)) + rng.normal(0, 0.05, 3)
        up = Rotation.random(random_state=int(rng.integers(2**31))).apply([0, 0, 9.8])
        way = up
        for step in steps:
            way = Rotation.from_rotvec(-step).apply(way)
        bias = rng.normal(0, 0.2, 3)
        out.append(ObservedTurn(up + bias, way + bias, steps @ axes))
    return out


@pytest.mark.parametrize("number", range(0, 48, 5))
def test_the_axes_that_gravity_tells_are_found(number: int) -> None:
    axes = signed_axes()[number]
    found = axes_by_turns(turned(axes, np.random.default_rng(number)))
    if number == 0:
        assert found is None
    else:
        np.testing.assert_array_equal(found, axes)


def test_all_signed_permutations_are_tried_once() -> None:
    every = {tuple(axes.ravel()) for axes in signed_axes()}
    assert len(every) == 48
    np.testing.assert_array_equal(signed_axes()[0], np.eye(3))


def test_turns_about_one_axis_do_not_tell_the_others() -> None:
    rng = np.random.default_rng(3)
    swapped = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
    about_x = [
        ObservedTurn(one.before, Rotation.from_rotvec([-a, 0, 0]).apply(one.before),
                 np.tile([0, a / 40, 0], (40, 1)))
        for one, a in zip(turned(swapped, rng), np.linspace(0.5, 2, 6), strict=True)
    ]  # fmt: skip
    assert axes_by_turns(about_x) is None


def test_what_no_axes_close_and_few_turns_tell_nothing() -> None:
    rng = np.random.default_rng(4)
    swapped = signed_axes()[11]
    seen = turned(swapped, rng)
    astray = [one._replace(behind=rng.normal(0, 6, 3)) for one in seen]
    assert axes_by_turns(astray) is None
    assert axes_by_turns(seen[:2]) is None
