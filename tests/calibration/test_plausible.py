"""Values that no device has are told from those that are merely large."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from fieldcal.calibration.parameters import Nominal
from fieldcal.calibration.plausible import implausible_values, misdirected_turns


@pytest.mark.parametrize(
    ("value", "sigma", "odd"),
    [(-90.0, 0.01, True), (4050.0, 0.005, True), (12.0, 0.01, True),
     (12.0, 1.0, False), (3.0, 0.01, False), (-9.0, 0.1, False)],
)  # fmt: skip
@pytest.mark.parametrize("name", ["angle_offset.alpha0_deg", "base_tilt.about_x_deg"])
def test_a_base_out_of_level_by_tens_of_degrees_is_another_mounting(
    name: str, value: float, sigma: float, odd: bool
) -> None:
    said = implausible_values([name], np.array([value]), np.array([sigma]), Nominal())
    assert bool(said) == odd
    if odd:
        assert "[frame] mounting" in said[0] and name in said[0]


@pytest.mark.parametrize(
    ("name", "value", "sigma", "odd"),
    [("acc_scale.y", 0.80, 0.038, True), ("acc_scale.y", 0.80, 0.05, False),
     ("acc_scale.x", 1.09, 1e-4, False), ("gyr_scale.z", 1.11, 0.02, True),
     ("acc_bias.x", 5.1, 0.5, True), ("acc_bias.x", 5.1, 1.1, False),
     ("acc_bias.z", -4.9, 0.01, False), ("gyr_bias.y", -0.51, 0.05, True)],
)  # fmt: skip
def test_a_value_that_no_sensor_has_is_none_unless_it_is_as_uncertain(
    name: str, value: float, sigma: float, odd: bool
) -> None:
    """More than 10 %, half a g or 30 deg/s from nominal, and by five sigma."""
    said = implausible_values([name], np.array([value]), np.array([sigma]), Nominal())
    assert bool(said) == odd
    if odd:
        assert name in said[0] and "no sensor is that far off" in said[0]


def test_turns_that_led_elsewhere_are_named_three_by_three() -> None:
    """Of four the fourth is counted."""
    assert misdirected_turns([]) == []
    names = [f"position {i}" for i in range(1, 6)]
    pairs = list(pairwise(names))
    after = (
        ": an axis, a sign, a unit or an angle is another than session.toml says,"
        " samples of the turn are missing, or the gyroscopes were clipped; mend it, or"
        " turn more slowly"
    )
    said = "the gyroscopes lead to another attitude than the accelerometers or the"
    for count, start, listed in (
        (1, "in 1 turn ", f"{names[0]} to {names[1]}"),
        (3, "in 3 turns ", f"{names[0]} to {names[1]}, {names[1]} to {names[2]} and"
         f" {names[2]} to {names[3]}"),
        (4, "in 4 turns ", f"{names[0]} to {names[1]}, {names[1]} to {names[2]} and"
         f" {names[2]} to {names[3]}, and 1 more"),
    ):  # fmt: skip
        (text,) = misdirected_turns(pairs[:count])
        assert text == f"{start}{said} stated angles (from {listed}){after}"
