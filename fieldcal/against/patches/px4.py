"""PX4 SIH: calibration parameters that make its samples those of the device.

SIH's own sensors have no parameter: no bias, and noise of 0.1 m/s^2 and 0.01 rad/s,
more while motors run. What PX4 corrects them by has,

    a = (r - CAL_ACC0_OFF) CAL_ACC0_SCALE,    w = r - CAL_GYRO0_OFF                 (1)

so that r = f comes out as b + k f with SCALE = k and OFF = -b / k, and W = w + b with
OFF = -b. That is seen in sensor_combined and by the estimator, not in sensor_accel and
sensor_gyro. m/s^2, rad/s. Source: PX4, sih.cpp (reconstruct_sensors_signals) and
parameter reference, CAL_*; the ids are those of its simulated sensors.
"""

from __future__ import annotations

from fieldcal.against.sensor_model import SensorModel

WHAT = "PX4 SIH, parameters CAL_*"
ENDING = ".params"
HOLDS = ("acc_bias", "acc_scale", "gyr_bias")

SIMULATED = 1310988
"""Device id of PX4's simulated accelerometer and gyroscope."""

INTEGER, FLOAT = 6, 9
"""What a parameter file calls integers and floating point numbers of 32 bits."""


def text(model: SensorModel) -> tuple[str, list[str]]:
    """The parameter file, and what the user must know."""
    says = ["compare with sensor_combined: sensor_accel is before the correction"]
    if model.noise:
        says.append("SIH's noise at rest is fixed at 0.1 m/s^2 and 0.01 rad/s")
    lines = ["# fieldcal: makes SIH's IMU like the recording"]
    lines += ["# Vehicle-Id Component-Id Name Value Type"]
    if {"acc_bias", "acc_scale"} & set(model.calibration):
        bias, scale = model.group("acc_bias"), model.group("acc_scale")
        lines.append(_line("CAL_ACC0_ID", SIMULATED, INTEGER))
        for axis, b, k in zip("XYZ", bias, scale, strict=True):
            lines.append(_line(f"CAL_ACC0_{axis}OFF", -b / k, FLOAT))  # (1)
            lines.append(_line(f"CAL_ACC0_{axis}SCALE", k, FLOAT))
    if "gyr_bias" in model.calibration:
        lines.append(_line("CAL_GYRO0_ID", SIMULATED, INTEGER))
        for axis, b in zip("XYZ", model.group("gyr_bias"), strict=True):
            lines.append(_line(f"CAL_GYRO0_{axis}OFF", -b, FLOAT))
    return "\n".join(lines) + "\n", says


def _line(name: str, value: float, kind: int) -> str:
    return f"1\t1\t{name}\t{value:.9g}\t{kind}"
