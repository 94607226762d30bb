"""Values that no device has are told from those that are merely large."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.calibration.parameters import Nominal
from fieldcal.calibration.plausible import senseless


@pytest.mark.parametrize(
    ("value", "sigma", "odd"),
    [(-90.0, 0.01, True), (4050.0, 0.005, True), (12.0, 0.01, True),
     (12.0, 1.0, False), (3.0, 0.01, False), (-9.0, 0.1, False)],
)  # fmt: skip
@pytest.mark.parametrize("name", ["angle_offset.alpha0_deg", "base_tilt.about_x_deg"])
def test_a_base_out_of_level_by_tens_of_degrees_is_another_mounting(
    name: str, value: float, sigma: float, odd: bool
) -> None:
    said = senseless([name], np.array([value]), np.array([sigma]), Nominal())
    assert bool(said) == odd
    if odd:
        assert "[frame] mounting" in said[0] and name in said[0]
