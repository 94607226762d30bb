"""A strap-down simulator of its own: numpy, and nothing else.

    python strapdown.py PATCH OUT

holds a device in nine positions, turned about z by alpha and then about the turned x by
beta (x East, y down, z north), and writes what its IMU says as CSV. PATCH is JSON,

    {"bias": {"acc": [3], "gyr": [3]}, "matrix": {"acc": [[3] * 3], ...},
     "noise": {"acc": [3], "gyr": [3]}, "effects": {"quadratic": {"x": 0.0}}, "seed": 1}

all of it optional: U = bias + M f + quadratic f^2 + noise. If it has none of it, the
device is perfect. SI units.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

ANGLES = (
    (0, 0),
    (45, 0),
    (-45, 0),
    (0, 40),
    (90, 0),
    (45, -40),
    (-90, 0),
    (0, -80),
    (180, 0),
)
HELD_S, TURN_S, RATE_HZ, GRAVITY = 15.0, 6.0, 50.0, 9.8106


def schedule(start: float = 3.0) -> list[dict[str, float]]:
    """Tables of session.toml: the angles, and when they are held."""
    begins = [start + i * (HELD_S + TURN_S) for i in range(len(ANGLES))]
    return [
        {"alpha_deg": a, "beta_deg": b, "start_s": s, "end_s": s + HELD_S}
        for (a, b), s in zip(ANGLES, begins, strict=True)
    ]


def _axes(alpha: Any, beta: Any) -> Any:
    """Rows are the axes of the turned device in the base, (n, 3, 3)."""
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    no, one = np.zeros_like(alpha), np.ones_like(alpha)
    about_z = np.array([[ca, sa, no], [-sa, ca, no], [no, no, one]])
    about_x = np.array([[one, no, no], [no, cb, sb], [no, -sb, cb]])
    return np.moveaxis(about_x, 2, 0) @ np.moveaxis(about_z, 2, 0)


def _angles(t: Any, knots: list[float], columns: Any) -> Any:
    """Alpha and beta at some times, (2, n) rad."""
    return np.deg2rad([np.interp(t, knots, column) for column in columns])


def attitude(off: float = 0.0, start: float = 3.0) -> tuple[Any, Any]:
    """Times (n,), and rows of the device's axes in the base a little later, (n, 3, 3).

    `off` is by how much, s.
    """
    tables = schedule(start)
    t = np.arange(0.0, tables[-1]["end_s"] + 3.0, 1 / RATE_HZ)
    knots, values = [], []
    for one in tables:
        knots += [one["start_s"] - 0.5, one["end_s"] + 0.5]
        values += [[one["alpha_deg"], one["beta_deg"]]] * 2
    columns = np.array(values, float).T
    return t, _axes(*_angles(t + off, knots, columns))


def motion(start: float = 3.0, gravity: float = GRAVITY) -> tuple[Any, Any, Any]:
    """Times (n,), specific force (n, 3), and angular rate (n, 3) in device axes."""
    half = 0.5 / RATE_HZ
    t, axes = attitude(0.0, start)
    before, after = (attitude(off, start)[1] for off in (-half, half))
    force = axes @ np.array([0.0, -gravity, 0.0])
    # C(t + dt) C(t)^T = 1 - [w dt x] for the rate w in device axes
    step = after @ np.swapaxes(before, 1, 2)
    pairs = ((1, 2), (2, 0), (0, 1))
    turned = [step[:, i, j] - step[:, j, i] for i, j in pairs]
    rate = 0.5 * RATE_HZ * np.column_stack(turned)
    return t, force, rate


def earth(start: float = 3.0, latitude: float = 0.88) -> Any:
    """The Earth's rate in device axes, (n, 3) rad/s; the fixture points north."""
    base = 7.292115e-5 * np.array([0.0, -np.sin(latitude), np.cos(latitude)])
    return attitude(0.0, start)[1] @ base


def outputs(
    device: Mapping[str, Any], start: float = 3.0, gravity: float = GRAVITY
) -> Any:
    """Times and the six outputs, (n, 7)."""
    t, force, rate = motion(start, gravity)
    rng = np.random.default_rng(int(device.get("seed", 1)))
    columns = [t[:, None]]
    for triad, true in (("acc", force), ("gyr", rate)):
        matrix = np.array(device.get("matrix", {}).get(triad, np.eye(3)), float)
        bias = np.array(device.get("bias", {}).get(triad, [0.0] * 3), float)
        noise = np.array(device.get("noise", {}).get(triad, [0.0] * 3), float)
        columns.append(true @ matrix.T + bias + noise * rng.standard_normal(true.shape))
    even = device.get("effects", {}).get("quadratic", {})
    columns[1] = columns[1] + force**2 * [even.get(axis, 0.0) for axis in "xyz"]
    return np.hstack(columns)


def main() -> None:
    """Read the patch, and write the file."""
    patch, out = map(Path, sys.argv[1:3])
    text = patch.read_text("utf-8")
    table = outputs(json.loads(text) if text.strip() else {})
    head = "t (s),ax (m/s^2),ay (m/s^2),az (m/s^2),gx (rad/s),gy (rad/s),gz (rad/s)"
    np.savetxt(out, table, fmt="%.9g", delimiter=",", header=head, comments="")


if __name__ == "__main__":
    main()
