"""Devices at rest in a navigator that drifts, and what it computes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from scipy.spatial.transform import Rotation

from benchmarks.concealed.mechanisation import OMEGA, Array, navigated

LATITUDE_DEG, G, RATE_HZ = 50.45, 9.8106, 10.0
BEGAN = (3.0, -2.0, 5.0)
"""Where a navigator begins, m."""

FACES = ((0, 0), (90, 0), (180, 0), (-90, 0), (0, 90), (0, -90))


@dataclass(frozen=True)
class Sensors:
    """What the sensors of a navigator are off by; noise per sqrt(Hz)."""

    acc_bias: Array
    acc_scale: Array
    gyr_bias: Array
    force_noise: float = 1e-3
    rate_noise: float = 5e-5

    @classmethod
    def drawn(cls, rng: np.random.Generator, rate_noise: float = 5e-5) -> Sensors:
        """Any sensors of tactical grade."""
        return cls(
            rng.normal(0, 0.02, 3), 1 + rng.normal(0, 1e-3, 3),
            rng.normal(0, 2e-4, 3), rate_noise=rate_noise,
        )  # fmt: skip

    @property
    def truth(self) -> dict[str, Array]:
        """Biases and scale factors by group."""
        return {
            "acc_bias": self.acc_bias,
            "acc_scale": self.acc_scale,
            "gyr_bias": self.gyr_bias,
        }


def axes(alpha: float, beta: float) -> Array:
    """Base to device: about z by alpha, then about the turned x by beta, degrees."""
    ca, sa = np.cos(np.deg2rad(alpha)), np.sin(np.deg2rad(alpha))
    cb, sb = np.cos(np.deg2rad(beta)), np.sin(np.deg2rad(beta))
    about_z = np.array([[ca, sa, 0.0], [-sa, ca, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cb, sb], [0.0, -sb, cb]])
    return np.asarray(about_x @ about_z)


def record(
    folder: Path,
    sensors: Sensors,
    rng: np.random.Generator,
    *,
    faces: Sequence[tuple[int, int]] = FACES,
    seconds: float = 100.0,
    tilt_deg: Array | None = None,
    own_deg: Array | None = None,
    setting_deg: float = 0.01,
    azimuth_deg: float = 0.0,
    columns: Sequence[str] = ("vn", "ve", "vd"),
    aligned: str = "entered",
    out_noise: float | Array = 1e-3,
) -> Path:
    """Write session.toml and solution.csv of a base that is tilted by a little.

    `own_deg`, (r, 3), is what each attitude is off by beyond how well it is set;
    `out_noise` that of the outputs, alike (m/s, m) or of each velocity and position.
    """
    a = np.deg2rad(azimuth_deg)
    turned = np.array(
        [[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]]
    )
    tilt = np.zeros(3) if tilt_deg is None else np.deg2rad(tilt_deg)
    own = np.zeros((len(faces), 3)) if own_deg is None else np.deg2rad(own_deg)
    rows, positions = [], []
    for i, (alpha, beta) in enumerate(faces):
        told = axes(alpha, beta)
        setting = np.deg2rad(rng.normal(0, setting_deg, 3))
        real = told @ Rotation.from_rotvec(tilt + setting + own[i]).as_matrix()
        both = _solution(sensors, rng, real, told, turned, seconds, aligned)
        both += out_noise * rng.standard_normal(both.shape)
        start = 1000.0 * i
        rows.append(np.column_stack([start + np.arange(len(both)) / RATE_HZ, both]))
        positions.append({"alpha_deg": float(alpha), "beta_deg": float(beta)}
                         | {"start_s": start, "end_s": start + seconds})  # fmt: skip
    navigator = {"azimuth_deg": azimuth_deg, "azimuth_sd_deg": 0.5, "aligned": aligned}
    about: dict[str, Any] = {
        "format": 1,
        "site": {
            "latitude_deg": LATITUDE_DEG, "gravity": G, "level_deg": 0.02,
            "angle_setting_deg": setting_deg,
        },
        "navigator": navigator,
        "position": positions,
    }  # fmt: skip
    _write(folder, np.vstack(rows), columns, about)
    return folder


def _solution(
    sensors: Sensors,
    rng: np.random.Generator,
    real: Array,
    told: Array,
    turned: Array,
    seconds: float,
    aligned: str,
) -> Array:
    """Velocity and position that a navigator computes, (n + 1, 6).

    Parameters
    ----------
    sensors, rng : what it measures with, and their noise
    real, told : (3, 3) base to device, as it is and as it was entered
    turned : (3, 3) from north to the axes of the base
    seconds, aligned : how long, and whether it levels itself

    """
    phi, n = np.deg2rad(LATITUDE_DEG), int(seconds * RATE_HZ)
    earth = turned @ (OMEGA * np.array([0.0, -np.sin(phi), np.cos(phi)]))
    force = sensors.acc_bias + sensors.acc_scale * (real @ [0.0, -G, 0.0])
    rate = sensors.gyr_bias + real @ earth
    if aligned == "itself":  # level by its accelerometers: that force is up
        told = _levelled(told, force)
    noise = rng.standard_normal((2, n, 3)) * np.sqrt(RATE_HZ)
    v, p = navigated(
        rate + sensors.rate_noise * noise[0],
        force + sensors.force_noise * noise[1],
        1 / RATE_HZ,
        turned.T @ told.T,
        phi,
        G,
    )
    moved = np.vstack([np.zeros(6), np.hstack([v, p])])
    return np.asarray(moved + np.array([0.0, 0.0, 0.0, *BEGAN]))


def _write(
    folder: Path, rows: Array, columns: Sequence[str], about: dict[str, Any]
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    names = ("t", "ve", "vd", "vn", "pe", "pd", "pn")
    kept = [i for i, name in enumerate(names) if name in ("t", *columns)]
    np.savetxt(
        folder / "solution.csv", rows[:, kept], delimiter=",",
        header=",".join(names[i] for i in kept), comments="", fmt="%.9g",
    )  # fmt: skip
    (folder / "session.toml").write_text(tomlkit.dumps(about))


def _levelled(told: Array, force: Array) -> Array:
    """The attitude in which this force is straight up, turned from what is told."""
    up = told.T @ force / np.linalg.norm(force)
    level = np.array([0.0, -1.0, 0.0])
    axis = np.cross(up, level)
    angle = np.arcsin(np.linalg.norm(axis))
    if angle == 0:
        return told
    turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle).as_matrix()
    return np.asarray(told @ turn.T)
