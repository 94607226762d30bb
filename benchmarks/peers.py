"""Solve time and accuracy beside imucal on its own session, and a plain norm fit."""

from __future__ import annotations

import csv
import gzip
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from fieldcal.core.positions import SIX_FACES, Position
from fieldcal.core.samples import Array
from fieldcal.solve import Observations, solve

SESSION = (
    Path(__file__).resolve().parents[2]
    / "shared/real/imucal_ferraris/annotated_session.csv.gz"
)
FACES = ("y_a", "y_p", "x_a", "x_p", "z_p", "z_a")
COUNTS = 2048 / 9.81
IMPORT = """
import time, numpy
began = time.perf_counter()
import {}
print(time.perf_counter() - began)
"""
TRUTH = np.array([0.12, -0.08, 0.21, 1.004, 0.997, 1.006, 0.004, -0.011, 0.007])


def _best(what: Callable[[], Any], runs: int = 5) -> tuple[float, Any]:
    times = []
    for _ in range(runs):
        began = perf_counter()
        result = what()
        times.append(perf_counter() - began)
    return min(times), result


def ferraris() -> None:
    """Print both solutions of the six faces."""
    if not SESSION.is_file():
        print(f"no session to compare on: {SESSION.name} is not beside the project")
        return
    parts: dict[str, list[list[float]]] = {}
    with gzip.open(SESSION, "rt") as file:
        for row in csv.DictReader(file):
            six = [float(row[f"{s}_{x}"]) for s in ("acc", "gyr") for x in "xyz"]
            parts.setdefault(row["part"], []).append(six)
    table = {k: np.array(v) for k, v in parts.items()}
    mean, cov = [], []
    for face in FACES:
        samples = table[face]
        cells = samples[: len(samples) // 20 * 20].reshape(-1, 20, 6).mean(axis=1)
        mean.append(samples.mean(axis=0))
        cov.append(np.cov(cells.T) / len(cells))
    size = np.array([1 / COUNTS] * 3 + [np.deg2rad(1 / 16.4)] * 3)
    seen = Observations(
        SIX_FACES, np.array(mean) * size, np.array(cov) * np.outer(size, size), 9.81
    )
    took, ours = _best(lambda: solve(seen, method="least_squares"))
    bias, sigma = ours.vector("acc_bias")
    print("six faces of imucal's own session, accelerometers")
    _line("ours", took, ours.rms, bias, sigma)
    if find_spec("imucal") is None:
        print("imucal is not installed: pip install fieldcal[bench]")
        return
    took, peer = _best(lambda: _imucal(table))
    turned = np.linalg.inv(peer.K_a @ peer.R_a)
    raw = np.array([table[f][:, :3].mean(axis=0) for f in FACES])
    true = (raw - peer.b_a.ravel()) @ turned.T
    left = float(np.sqrt(np.mean((true - seen.forces) ** 2)))
    _line("imucal", took, left, peer.b_a.ravel() / COUNTS, None)


def _imucal(table: dict[str, Array]) -> Any:
    import pandas as pd
    from imucal import FerrarisCalibration, ferraris_regions_from_df

    columns = ["acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"]
    frame = pd.concat(
        pd.DataFrame(v, columns=columns, index=pd.Index([k] * len(v), name="part"))
        for k, v in table.items()
    )
    return FerrarisCalibration().compute(
        ferraris_regions_from_df(frame),
        sampling_rate_hz=204.8,
        from_acc_unit="a.u.",
        from_gyr_unit="a.u.",
    )


def _line(
    name: str, took: float, left: float, bias: Array, sigma: Array | None
) -> None:
    stated = (
        "no uncertainty"
        if sigma is None
        else "± " + " ".join(f"{s:.3f}" for s in sigma)
    )
    print(f"{name:8} {1e3 * took:8.2f} ms  residual {left:.4f} m/s^2  bias "
          f"{' '.join(f'{b:+.3f}' for b in bias)} m/s^2, {stated}")  # fmt: skip


def norm_fit() -> None:
    """Print both fits of norms: 14 windows by hand, of unequal noise, 200 seeds."""
    from scipy.optimize import least_squares

    rng = np.random.default_rng(0)
    f = rng.standard_normal((14, 3))
    f *= 9.81 / np.linalg.norm(f, axis=1, keepdims=True)
    m = np.diag(TRUTH[3:6])
    m[[0, 0, 1], [1, 2, 2]] = TRUTH[6:]
    size = rng.uniform(0.5e-3, 4e-3, (14, 3))
    cov = np.zeros((14, 6, 6))
    cov[:, range(3), range(3)] = size**2
    cov[:, range(3, 6), range(3, 6)] = 1.0

    def residual(x: Array, u: Array) -> Array:
        a = np.diag(x[3:6])
        a[[0, 0, 1], [1, 2, 2]] = x[6:]
        return np.asarray(
            np.linalg.norm((u - x[:3]) @ np.linalg.inv(a).T, axis=1) - 9.81
        )

    errors: dict[str, list[Array]] = {"ours": [], "scipy": []}
    times = dict.fromkeys(errors, 0.0)
    pulls = []
    start = np.array([0.0, 0, 0, 1, 1, 1, 0, 0, 0])
    for _ in range(200):
        u = TRUTH[:3] + f @ m.T + size * rng.standard_normal((14, 3))
        seen = Observations(
            (Position("by hand"),) * 14, np.hstack([u, np.full((14, 3), np.nan)]),
            cov, 9.81,
        )  # fmt: skip
        began = perf_counter()
        ours = solve(seen, cross=True)
        middle = perf_counter()
        plain = least_squares(residual, start, args=(u,))
        times["ours"] += middle - began
        times["scipy"] += perf_counter() - middle
        errors["ours"].append(ours.values - TRUTH)
        errors["scipy"].append(plain.x - TRUTH)
        pulls.append((ours.values - TRUTH) / ours.sigma)
    print("\nnorms of 14 windows of unequal noise, nine parameters, 200 seeds")
    for name, found in errors.items():
        rmse = np.sqrt(np.mean(np.square(found), axis=0))
        said = f"pulls {np.std(pulls):.2f}" if name == "ours" else "no uncertainty"
        bias, scale = 1e3 * rmse[:3].mean(), 1e4 * rmse[3:6].mean()
        print(f"{name:8} {1e3 * times[name] / 200:8.2f} ms  rmse of bias {bias:.2f} "
              f"mm/s^2, of scale {scale:.2f}e-4, {said}")  # fmt: skip


def import_time() -> None:
    """Print what importing costs beyond numpy."""
    print()
    for name in ("fieldcal.solve", "scipy.optimize", "imucal"):
        if find_spec(name.partition(".")[0]) is None:
            continue
        runs = [
            float(subprocess.check_output([sys.executable, "-c", IMPORT.format(name)]))
            for _ in range(5)
        ]
        print(f"import {name:15} {1e3 * min(runs):7.1f} ms beyond numpy")


def main() -> None:
    """Print all comparisons."""
    ferraris()
    norm_fit()
    import_time()
