"""What SITL makes of a motion, by its own equations, as a dataflash log.

    python sitl_like.py PARM OUT

reads lines `NAME value` of SIM_*, and writes messages IMU. The equations stand in
ArduPilot's AP_InertialSensor_SITL.cpp: force over SIM_ACC1_SCAL, 0 counting as 1, plus
SIM_ACC1_BIAS; rate times 1 + SIM_GYR1_SCALE / 100, plus SIM_GYR1_BIAS; noise that is
uniform within 0.01 m/s^2 and 0.04 deg/s.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import strapdown
from logs import dataflash

from fieldcal.core.samples import Block


def outputs(parameters: dict[str, float], seed: int) -> Any:
    """Times and the six outputs, (n, 7)."""

    def vector(name: str, default: float) -> Any:
        return np.array([parameters.get(f"{name}_{axis}", default) for axis in "XYZ"])

    t, force, rate = strapdown.motion()
    rng = np.random.default_rng(seed)
    scale = vector("SIM_ACC1_SCAL", 0.0)
    acc = force / np.where(scale == 0.0, 1.0, scale) + vector("SIM_ACC1_BIAS", 0.0)
    acc += 0.01 * rng.uniform(-1, 1, acc.shape)
    gyr = rate + np.deg2rad(0.04) * rng.uniform(-1, 1, rate.shape)
    gyr = gyr * (1 + 0.01 * vector("SIM_GYR1_SCALE", 0.0)) + vector("SIM_GYR1_BIAS", 0)
    return np.column_stack([t, acc, gyr])


def read(path: Path) -> dict[str, float]:
    """Parameters of a file."""
    lines = [line.split() for line in path.read_text("utf-8").splitlines()]
    return {w[0]: float(w[1]) for w in lines if len(w) == 2 and w[0][0] != "#"}


def main() -> None:
    """Read the parameters, and write the log."""
    patch, out = map(Path, sys.argv[1:3])
    table = outputs(read(patch), 11)
    none = np.full(len(table), np.nan)
    warm = np.full(len(table), 25.0)
    block = Block.of(table[:, 0], table[:, 1:4], table[:, 4:], warm, none, none)
    out.write_bytes(dataflash({0: block}, {}))


if __name__ == "__main__":
    main()
