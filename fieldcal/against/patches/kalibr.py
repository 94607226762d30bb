"""Kalibr's and OpenVINS' imu.yaml, from which their simulators draw: true -> raw.

    U = M_a f + b_a,    W = M_g C w + b_g                                            (1)

as `fieldcal.exporters.kalibr` writes it. A noise density is that of white noise of
deviation sigma at a rate r, sigma / sqrt(r), of the loudest axis. m/s^2, rad/s.
Source: Kalibr wiki, IMU noise model and yaml formats.
"""

from __future__ import annotations

import numpy as np

from fieldcal.against.patches import assumed_sentence
from fieldcal.against.sensor_model import CALIBRATION, LINEAR, SensorModel
from fieldcal.exporters.kalibr import split_rotation, yaml_array

WHAT = "Kalibr and OpenVINS, imu.yaml"
ENDING = "_imu.yaml"
HOLDS = (
    *("acc_bias", "acc_scale", "gyr_bias", "gyr_scale", "noise"),
    *LINEAR,
)


def text(model: SensorModel) -> tuple[str, list[str]]:
    """The file, and what the user must know."""
    lines = ["# fieldcal: raw = M true + bias (true -> raw), m/s^2 and rad/s"]
    says = ["random walks are as they were: no comparison of minutes shows them"]
    for name, triad in (("accelerometer", "acc"), ("gyroscope", "gyr")):
        levels = [model.level(f"{triad[0]}{axis}") for axis in "xyz"]
        if model.noise and model.knows_noise(triad) and model.rate_hz > 0:
            density = max(levels) / np.sqrt(model.rate_hz)
            lines.append(f"{name}_noise_density: {density:.6g}")
    if model.rate_hz > 0:
        lines.append(f"update_rate: {model.rate_hz:.6g}")
    if model.calibration or set(model.effects) & set(LINEAR):
        unknown = model.assumed((*CALIBRATION, *LINEAR))
        lines += [f"# {one}: not shown, as of a perfect sensor" for one in unknown]
        says += assumed_sentence(unknown, "the file")
        lines += _linear(model)
    return "\n".join(lines) + "\n", says


def _linear(model: SensorModel) -> list[str]:
    """Matrices and biases."""
    lower, turn = split_rotation(model.matrix("gyr"))
    return [
        "model: scale-misalignment",
        "accelerometers:",
        f"  M: {yaml_array(model.matrix('acc'))}",
        f"  bias: {yaml_array(model.group('acc_bias'))}",
        "gyroscopes:",
        f"  M: {yaml_array(lower)}",
        f"  C_gyro_i: {yaml_array(turn)}",
        "  A: [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]",
        f"  bias: {yaml_array(model.group('gyr_bias'))}",
    ]
