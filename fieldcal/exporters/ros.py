"""A yaml of ROS's imu_calib (apply_calib): raw -> true.

imu_calib corrects  f = SM U - bias                                                (1)

so that its bias is subtracted after the matrix. fieldcal has U = b + M f, hence

    SM = M^-1,  bias = M^-1 b                                                      (2)

exactly. SM is written row by row. imu_calib itself reads the two keys of the
accelerometers; gyro_SM and gyro_bias are for nodes that correct gyroscopes likewise. If
the session has a noise.json, the covariances of single samples follow.
Units: m/s^2, rad/s, as in sensor_msgs/Imu. Source: imu_calib's documentation.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.exporters import ExportSource
from fieldcal.session.file_writing import write_atomically
from fieldcal.session.noise_file import read_noise

WHAT = "yaml of ROS imu_calib (SM, bias)"
ENDING = "_imu_calib.yaml"


def matrices(bias: Array, matrix: Array) -> tuple[Array, Array]:
    """SM (3, 3) and bias (3,) of U = bias + matrix f, (2)."""
    inverse = np.linalg.inv(matrix)
    return inverse, inverse @ bias  # (2)


def _covariance_lines(told: Mapping[str, Any]) -> list[str]:
    """Lines with covariances of single samples, row by row as in sensor_msgs/Imu."""
    lines = []
    for what in ("linear_acceleration", "angular_velocity"):
        name = f"{what}_covariance"
        values = [told.get(f"{name}[{i}]", {}).get("value", 0.0) for i in range(9)]
        if any(values):
            lines += [f"{name}:", *(f"  - {x:.12e}" for x in values)]
    return lines


def write(source: ExportSource, path: Path) -> list[str]:
    """Write the file; returns notices for the user."""
    lines = ["# fieldcal: true = SM raw - bias (raw -> true), m/s^2 and rad/s"]
    lines += [f"# {kind} was not determined: 0" for kind in source.zero_couplings]
    for sensor, prefix in (("acc", ""), ("gyr", "gyro_")):
        turned, bias = matrices(*source.linear(sensor))
        for name, values in ((f"{prefix}SM", turned.ravel()), (f"{prefix}bias", bias)):
            lines.append(f"{name}:")
            lines += [f"  - {x:.12f}" for x in values]
    if found := read_noise(source.session.folder):
        lines += _covariance_lines(found["for"]["ros"])
    write_atomically(path, "\n".join(lines) + "\n")
    return source.matrix_notices
