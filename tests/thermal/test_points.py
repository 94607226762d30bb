"""A calibration as a point of the temperature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calibrations import calibration

from fieldcal.core.errors import InputError
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import ARDUPILOT, PX4, parameter_names
from fieldcal.thermal import thermal_point

WARM = {"conditions": {"temperature_degc": 21.5, "temperature_sd_k": 0.2}}


def installed(program: int, **more: float) -> InstalledCalibration:
    known = parameter_names(program, 1)
    values = dict(zip(known["acc_offset"], (0.1, -0.2, 0.3), strict=True))
    values |= dict(zip(known["acc_scale"], (1.1, 0.9, 1.05), strict=True))
    values |= dict(zip(known["gyr_offset"], (0.01, 0.02, -0.03), strict=True))
    values |= dict.fromkeys(known["rotation"], 0.0)
    return InstalledCalibration(program, 1, {**values, **more})


@pytest.mark.parametrize("program", [ARDUPILOT, PX4])
def test_a_point_is_of_the_sensors_own_output(program: int) -> None:
    """What is found behind (r - o) k, put together with o and k, predicts r."""
    rng = np.random.default_rng(1)
    found = calibration(rng, cross=0.01, gyr_scale=0.01)
    there = installed(program)
    info = {**WARM, "installed": there.as_table()}
    made = thermal_point("s", replace(found, info=info)).calibration
    for sensor, o, k in (
        ("acc", there.vector("acc_offset"), there.vector("acc_scale")),
        ("gyr", there.vector("gyr_offset"), np.ones(3)),
    ):
        which = "accelerometers" if sensor == "acc" else "gyroscopes"
        bias, matrix = getattr(found, which)()
        own_bias, own_matrix = getattr(made, which)()
        for f in rng.normal(0, 5, (5, 3)):
            sent = bias + matrix @ f
            np.testing.assert_allclose(own_bias + own_matrix @ f, sent / k + o)
    ratio = made.uncertainty("acc_scale.x") / found.uncertainty("acc_scale.x")
    assert ratio == pytest.approx(1 / 1.1)


def test_samples_with_nothing_taken_out_are_the_sensors_own() -> None:
    found = replace(calibration(np.random.default_rng(2), 0.0), info=WARM)
    made = thermal_point("s", found)
    assert made.temperature == 21.5 and made.temperature_sd == 0.2
    np.testing.assert_array_equal(made.calibration.values, found.values)


def test_where_values_are_of_the_end_so_is_the_temperature() -> None:
    as_of = {"since_start_s": 300.0, "temperature_degc": 31.0}
    info = {**WARM, "carried": {"as_of": as_of}}
    made = thermal_point(
        "s", replace(calibration(np.random.default_rng(2), 0.0), info=info)
    )
    assert made.temperature == 31.0 and made.temperature_sd == 0.0


def test_what_makes_no_point_is_refused() -> None:
    found = replace(calibration(np.random.default_rng(3), 0.0), info=WARM)
    with pytest.raises(InputError, match="s: the calibration is bad"):
        thermal_point("s", replace(found, good=False))
    with pytest.raises(InputError, match="s: the device told no temperature"):
        thermal_point("s", replace(found, info={}))
    for program, name in ((ARDUPILOT, "INS_TCAL2_ENABLE"), (PX4, "TC_A_ENABLE")):
        table = installed(program, **{name: 1.0}).as_table()
        with pytest.raises(InputError, match=f"s: {name} was 1.*set it to 0"):
            thermal_point("s", replace(found, info={**WARM, "installed": table}))
