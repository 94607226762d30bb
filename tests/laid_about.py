"""A device laid on each of its sides in turn, written apart from what reads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fieldcal.core.samples import Array

G = 9.80665
COLUMNS = "t,ax,ay,az,gx,gy,gz"
GYR = {"rad/s": 1.0, "deg/s": 180 / np.pi} | {
    f"{lsb} in deg/s": lsb * 180 / np.pi for lsb in (131.072, 65.536, 32.768, 16.384)
}
"""What 1 rad/s is, by the unit."""

SIDES = [(0, 0, 1), (0, 1, 0), (0, 0, -1), (1, 0, 0), (0, -1, 0), (-1, 0, 0), (0, 0, 1)]


def turned(seed: int, rate: float, hold: float = 2.0, sides: int = 5) -> Array:
    """Rows t, a, w of a device that is laid on some of `SIDES` in turn, SI.

    Five have every axis along gravity once, and turn about two; all seven have each
    axis up and down.
    """
    rng = np.random.default_rng(seed)
    up, rows = np.array(SIDES[0], float), []
    for side in SIDES[:sides]:
        axis, steps = np.cross(up, side), int(1.5 * rate)
        angle = (1 - np.cos(np.pi * (np.arange(steps) + 0.5) / steps)) * np.pi / 4
        speed = np.gradient(angle, 1 / rate)
        across = np.cross(axis, up)
        for a, w in zip(angle, speed, strict=True) if axis.any() else ():
            now = np.cos(a) * up + np.sin(a) * across
            rows.append([*G * now, *(-w * axis)])
        up = np.array(side, float)
        rows += [[*G * up, 0, 0, 0]] * int(hold * rate)
    table = np.array(rows)
    table[:, :3] += rng.normal(0, 0.02, (len(rows), 3)) + rng.uniform(-0.3, 0.3, 3)
    table[:, 3:] += rng.normal(0, 0.002, (len(rows), 3)) + rng.uniform(-0.02, 0.02, 3)
    return np.column_stack([np.arange(len(rows)) / rate, table])


def write(folder: Path, rows: Array, name: str = "log.csv", heading: str = "") -> Path:
    """Write rows of numbers below a heading."""
    path = folder / name
    lines = [heading] if heading else []
    lines += [",".join(f"{x:.10g}" for x in row) for row in rows]
    path.write_text("\n".join(lines) + "\n")
    return path
