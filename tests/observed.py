"""What ideal devices would show, worked out apart from the estimators."""

from __future__ import annotations

import csv
import gzip
import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from fieldcal.calibration import Nominal
from fieldcal.core.gravity import normal_gravity
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.solve import Observations
from fieldcal.windows import Average

G = 9.81
OMEGA = 7.292115e-5
SHARED = Path(__file__).resolve().parents[2] / "shared"

BIAS = np.array([0.12, -0.08, 0.21])
SCALE = np.array([1.004, 0.997, 1.006])
COUPLING = np.array([[0.0, -0.008, 0.002], [0.006, 0.0, 0.003], [-0.004, 0.007, 0.0]])
GYR_BIAS = np.array([0.011, -0.032, 0.0021])


def carried(alpha: float | Array, beta: float | Array, vector: ArrayLike) -> Array:
    """Components of a vector in a frame turned by alpha about z, beta about x.

    Of n angles, of n vectors or of both, (n, 3).
    """
    seen = Rotation.from_rotvec(np.multiply.outer(-alpha, [0, 0, 1])).apply(vector)
    turn = Rotation.from_rotvec(np.multiply.outer(-beta, [1, 0, 0]))
    return np.asarray(turn.apply(seen))


def force(
    alpha: float, beta: float, offset: Sequence[float] = (0, 0),
    base: Sequence[float] | Array = (0, 0), g: float = G,
) -> Array:  # fmt: skip
    """Specific force at rest, angles in rad; the tilt is (alpha0, beta0) or (x, z).

    (n, 3) if each of x and z are n values.
    """
    home = carried(base[1], base[0], [0, -g, 0])
    return carried(alpha + offset[0], beta + offset[1], home)


def outputs(
    positions: Sequence[Position],
    *,
    offset_deg: Sequence[float] = (0, 0),
    base_deg: Sequence[float] = (0, 0),
    mounting: Array | None = None,
    bias: Array = BIAS,
    scale: Array = SCALE,
    coupling: Array | None = None,
    g: float = G,
) -> Array:
    """Accelerometers' means without noise, (n, 3), device axes."""
    p = np.eye(3) if mounting is None else mounting
    offset, base = np.deg2rad(offset_deg).tolist(), np.deg2rad(base_deg).tolist()
    m = np.diag(scale) + (0 if coupling is None else coupling)
    rows = []
    for at in positions:
        assert at.alpha is not None and at.beta is not None
        f = force(at.alpha, at.beta, offset, base, g)
        rows.append(bias + m @ (p.T @ f))
    return np.array(rows)


def observe(
    positions: Sequence[Position],
    acc: Array,
    *,
    gyr: Array | None = None,
    sigma: float = 1e-3,
    sigma_gyr: float = 2e-5,
    **known: Any,
) -> Observations:
    """Observations with white noise of known size in the windows."""
    n = len(positions)
    mean = np.full((n, 6), np.nan)
    mean[:, :3] = acc
    if gyr is not None:
        mean[:, 3:] = gyr
    cov = np.diag([sigma**2] * 3 + [sigma_gyr**2] * 3)
    known.setdefault("gravity", G)
    return Observations(tuple(positions), mean, np.tile(cov, (n, 1, 1)), **known)


def practice(name: str) -> tuple[Observations, dict[str, Any]]:
    """Load a practice session's windows and what it conceals."""
    folder = SHARED / "practice" / name
    if not folder.is_dir():
        pytest.skip(f"practice sessions are not here: {folder}")
    about = tomllib.loads((folder / "session.toml").read_text())
    with gzip.open(folder / "samples.csv.gz", "rt") as file:
        rows = csv.reader(file)
        next(rows)
        table = np.array(list(rows), dtype=float)
    positions, averages = [], []
    for p in about["position"]:
        inside = (table[:, 0] >= p["start_s"]) & (table[:, 0] < p["end_s"])
        six = table[inside, 1:7]
        positions.append(Position.deg(p["alpha_deg"], p["beta_deg"]))
        cov = np.cov(six.T) / len(six)
        averages.append(
            Average(six.mean(axis=0), cov, 24.0, len(six), p["start_s"], p["end_s"])
        )
    site = about["site"]
    observations = Observations.of(
        positions,
        averages,
        normal_gravity(site["latitude_deg"], site["height_m"]),
        latitude=float(np.deg2rad(site["latitude_deg"])),
        nominal=Nominal(**{k: tuple(v) for k, v in about["nominal"].items()}),
    )
    answers = json.loads((folder.parent / "answers.json").read_text())[name]
    return observations, answers


def motionless(t: Array, acc: Array, gyr: Array, seconds: float = 1.5) -> list[Average]:
    """Averages of the stretches in which gyroscopes and accelerometers are quiet.

    Written apart from `fieldcal.windows`: half a second whose spread is within eight
    times that of the quietest tenth is quiet, a tenth of a second is cut off the ends.
    """
    six = np.hstack([acc, gyr])
    width = int(round(0.5 / np.median(np.diff(t))))
    view = np.lib.stride_tricks.sliding_window_view(six, width, axis=0)
    spread = view.std(axis=-1)
    calm = (spread < 8 * np.quantile(spread, 0.1, axis=0)).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], calm.astype(int), [0]])))
    cut = width // 5
    found = []
    for a, b in zip(edges[::2], edges[1::2] + width - 1, strict=True):
        first, last = a + cut, b - cut
        if t[last - 1] - t[first] < seconds:
            continue
        cells = six[first : first + (last - first) // cut * cut]
        cells = cells.reshape(-1, cut, 6).mean(axis=1)
        cov = np.cov(cells.T) / len(cells)
        mean = six[first:last].mean(axis=0)
        found.append(Average(mean, cov, np.nan, last - first, t[first], t[last - 1]))
    return found
