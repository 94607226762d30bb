"""Matrices of imu_tk, two .calib files, accelerometers and gyroscopes: raw -> true.

imu_tk corrects with a misalignment T of unit diagonal, a scale K and a bias B,

    f = T K (U - B)                                                                (1)

(its paper writes a = T K (a_S + b), so b = -B). fieldcal has U = b + M f, hence

    B = b,  K = diag(M^-1),  T = M^-1 K^-1                                         (2)

which is exact. The T that imu_tk itself estimates for accelerometers is upper
triangular; here it is full if M is. The files contain T, K and B in this order, as
imu_tk reads them. Units: m/s^2, rad/s. Source: Tedaldi, Pretto, Menegatti, ICRA 2014.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.exporters import ExportSource
from fieldcal.session.file_writing import write_atomically

WHAT = "matrices of imu_tk (T, K, bias)"
ENDING = "_acc.calib"


def matrices(bias: Array, matrix: Array) -> tuple[Array, Array, Array]:
    """T, K (3, 3) and B (3,) of U = bias + matrix f, (2)."""
    inverse = np.linalg.inv(matrix)
    scale = np.diag(np.diag(inverse))
    return inverse @ np.linalg.inv(scale), scale, bias  # (2)


def write(source: ExportSource, path: Path) -> list[str]:
    """Write both files; returns notices for the user."""
    second = path.with_name(f"{path.stem.removesuffix('_acc')}_gyro{path.suffix}")
    if second.exists():
        raise InputError(f"{second}: is there already; name another file with -o")
    for sensor, file in (("acc", path), ("gyr", second)):
        parts = matrices(*source.linear(sensor))
        write_atomically(
            file, "\n\n".join(_format_array(part) for part in parts) + "\n"
        )
    return [
        *source.matrix_notices,
        f"the gyroscopes are in {second}",
        "true = T K (raw - B), m/s^2 and rad/s; T, K and B one after the other",
    ]


def _format_array(array: Array) -> str:
    rows = np.atleast_2d(array) if array.ndim == 2 else array[:, None]
    return "\n".join(" ".join(f"{x:.12g}" for x in row) for row in rows)
