"""ArduPilot SITL: a parameter file of SIM_*, for sim_vehicle.py --add-param-file.

SITL makes of the true force f and rate w of its physics, first IMU, axis by axis,

    U = f / SIM_ACC1_SCAL + SIM_ACC1_BIAS + noise + p_a(T)                          (1)
    W = (w + drift + noise + p_g(T)) (1 + SIM_GYR1_SCALE / 100) + SIM_GYR1_BIAS     (2)
    p(T) = 1e-6 (c1 d + c2 d^2 + c3 d^3),  d = T - (SIM_IMUT1_TMIN + _TMAX) / 2     (3)
    U += w x (w x r) + dw/dt x r,  r = SIM_IMU_POS                                  (4)

where a SCAL of 0 counts as 1. So SCAL = 1 / k, SCALE = 100 (s - 1), and c1 = 1e6 times
a temperature coefficient. The least noise, uniform within 0.01 m/s^2 and 0.04 deg/s, is
fixed; SIM_ACC1_RND and SIM_GYR1_RND add to it while motors run only. SIM_DRIFT_SPEED is
0.05 deg/s/min unless it is said. m/s^2, rad/s, deg C, m. Source: ArduPilot,
AP_InertialSensor_SITL.cpp, AP_InertialSensor_tempcal.cpp and SITL.cpp.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.against.sensor_model import SensorModel

WHAT = "ArduPilot SITL, parameters SIM_*"
ENDING = ".parm"
HOLDS = (
    *("acc_bias", "acc_scale", "gyr_bias", "gyr_scale"),
    *("gyro_scale", "temperature_bias", "lever_arm"),
)

SPAN_C = 35.0
"""Half of the range of a temperature calibration, K: its middle alone counts."""


def text(model: SensorModel) -> tuple[str, list[str]]:
    """The parameter file, and what the user must know."""
    says = []
    if model.noise:
        says.append(
            "SITL's noise at rest is fixed at 0.0058 m/s^2 and 0.0004 rad/s;"
            " SIM_ACC1_RND and SIM_GYR1_RND count while motors run only"
        )
    if "bias_drift" in model.effects:
        says.append(
            "SITL drifts by SIM_DRIFT_SPEED, alike on all axes and to and fro: 0.05"
            " deg/s in a minute unless it is set to 0"
        )
    lines = ["# fieldcal: makes SITL's first IMU like the recording"]
    lines += [f"{name} {value:.9g}" for name, value in _parameters(model)]
    return "\n".join(lines) + "\n", says


def _parameters(model: SensorModel) -> Iterator[tuple[str, float]]:
    known, effects = model.calibration, model.effects
    if "acc_bias" in known:
        yield from _axes("SIM_ACC1_BIAS", model.group("acc_bias"))
    if "acc_scale" in known:
        yield from _axes("SIM_ACC1_SCAL", 1 / model.group("acc_scale"))  # (1)
    if "gyr_bias" in known:
        yield from _axes("SIM_GYR1_BIAS", model.group("gyr_bias"))
    if "gyr_scale" in known or "gyro_scale" in effects:
        scale = model.group("gyr_scale") - 1
        scale = scale + [model.number("gyro_scale", n) for n in ("s1", "s2", "s3")]
        yield from _axes("SIM_GYR1_SCALE", 100 * scale)  # (2)
    if "temperature_bias" in effects:
        yield from _temperature(model)
    if "lever_arm" in effects:
        yield from _axes("SIM_IMU_POS", [model.number("lever_arm", n) for n in "xyz"])


def _temperature(model: SensorModel) -> Iterator[tuple[str, float]]:
    """Coefficients about the temperature at which the biases hold (3)."""
    middle = model.start_c if np.isfinite(model.start_c) else 25.0
    yield "SIM_IMUT1_ENABLE", 1
    yield "SIM_IMUT1_TMIN", middle - SPAN_C
    yield "SIM_IMUT1_TMAX", middle + SPAN_C
    for triad, name in (("a", "ACC"), ("g", "GYR")):
        slope = [1e6 * model.number("temperature_bias", f"{triad}{i}") for i in "xyz"]
        yield from _axes(f"SIM_IMUT1_{name}1", slope)


def _axes(name: str, values: object) -> Iterator[tuple[str, float]]:
    for axis, value in zip("XYZ", np.asarray(values, float), strict=True):
        yield f"{name}_{axis}", float(value)
