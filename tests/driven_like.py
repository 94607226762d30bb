"""A simulator of a body that is swung, patched by JSON.

    python driven_like.py PATCH OUT

writes what an IMU puts out that follows the motion, with the bias, the matrix, the
lever arm and the time constants of the patch, as CSV.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.in_motion.driven import Drive, recorded

DRIVE = Drive(3)
HEAD = "t (s),ax (m/s^2),ay (m/s^2),az (m/s^2),gx (rad/s),gy (rad/s),gz (rad/s)"


def device(patch: dict[str, Any]) -> dict[str, Any]:
    """What a patch says, as the motion program takes it."""
    bias, matrix = patch.get("bias", {}), patch.get("matrix", {})
    effects = patch.get("effects", {})
    arm, lag = effects.get("lever_arm", {}), effects.get("bandwidth", {})
    return {
        "bias": np.hstack([bias.get(t, [0.0] * 3) for t in ("acc", "gyr")]),
        "matrix_acc": matrix.get("acc", np.eye(3)),
        "matrix_gyr": matrix.get("gyr", np.eye(3)),
        "arm": [arm.get(axis, 0.0) for axis in "xyz"],
        "lag": (lag.get("acc", 0.0), lag.get("gyr", 0.0)),
    }


def written(path: Path, table: Any) -> str:
    """Write times and outputs, (n, 7)."""
    np.savetxt(path, table, fmt="%.9g", delimiter=",", header=HEAD, comments="")
    return str(path)


if __name__ == "__main__":
    given = device(json.loads(Path(sys.argv[1]).read_text("utf-8")))
    written(Path(sys.argv[2]), recorded(DRIVE, given, 50.0, 25.0))
