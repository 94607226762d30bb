"""The estimate against its bound, its own statements, the print, and bumps."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.names import Tilt
from fieldcal.core.positions import (
    FIVE_POSITIONS,
    TWO_POSITIONS,
    WIDE_POSITIONS,
    Position,
)
from fieldcal.core.samples import Array
from fieldcal.model.causes.planned import parameters, predict_outputs
from fieldcal.planning.planner import Ladder, best_positions
from fieldcal.solve import Observations
from fieldcal.solve import solve as estimate
from fieldcal.solve.five_position import axis_estimates

G = 9.81
SIGMA = 1e-3
SEEDS = 500
TRUTH = np.array([0.12, -0.08, 0.21, 1.004, 0.997, 1.006])
TILT = np.array([-1.0, -1.0])
SIX = (*WIDE_POSITIONS, Position.deg(0, 5))
NINE = (*SIX, Position.deg(-22, 0), Position.deg(22, 3), Position.deg(0, -5))


@dataclass(frozen=True)
class Model:
    """Bias, scale factor and perhaps a tilt."""

    tilt: Tilt = "none"

    @property
    def truth(self) -> Array:
        """What is put in, in the order of results."""
        return TRUTH if self.tilt == "none" else np.concatenate([TRUTH, TILT])

    def means(self, places: tuple[Position, ...]) -> tuple[Array, Array]:
        """Means without noise, and their derivatives."""
        names = parameters(*([] if self.tilt == "none" else [self.tilt]))
        return predict_outputs(names, self.truth, places, G)


OFFSET = Model("angle_offset")


def bound(model: Model, places: tuple[Position, ...]) -> Array:
    """Cramer-Rao bound, (p,)."""
    _, slope = model.means(places)
    rows = slope.reshape(-1, slope.shape[-1])
    return SIGMA * np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))


def noisy(
    model: Model, places: tuple[Position, ...], seeds: int, bump: float = 0.0
) -> Array:
    """Means of many sessions, (seeds, n, 3), one position of each pushed by `bump`."""
    rng = np.random.default_rng(1)
    u, _ = model.means(places)
    y = u + SIGMA * rng.standard_normal((seeds, len(places), 3))
    push = rng.standard_normal((seeds, 3))
    push *= bump * SIGMA / np.linalg.norm(push, axis=1, keepdims=True)
    y[np.arange(seeds), np.arange(seeds) % len(places)] += push
    return np.asarray(y)


def observed(places: tuple[Position, ...], u: Array) -> Observations:
    """One session."""
    mean = np.full((len(places), 6), np.nan)
    mean[:, :3] = u
    cov = np.tile(np.diag([SIGMA**2] * 3 + [1.0] * 3), (len(places), 1, 1))
    return Observations(places, mean, cov, G)


def solve(
    model: Model, places: tuple[Position, ...], y: Array
) -> tuple[list[Calibration], Array, Array]:
    """Calibrations, errors and stated uncertainties."""
    found = [estimate(observed(places, u), tilt=model.tilt) for u in y]
    error = np.array([f.values for f in found]) - model.truth
    return found, error, np.array([f.sigma for f in found])


def against_the_bound() -> None:
    """Print rmse over the bound, pulls, coverage and chi2 for three position sets."""
    print(f"{SEEDS} seeds, {SIGMA:g} m/s^2 on each mean")
    print(f"{'positions, tilt':26} rmse/bound  pull std    95 % holds   chi2/dof")
    planned = best_positions(5, Ladder(), G)
    cases = [("two", TWO_POSITIONS, Model()), ("five", FIVE_POSITIONS, OFFSET),
             ("wide", WIDE_POSITIONS, OFFSET),
             ("planned", planned, OFFSET),
             ("planned", planned, Model("base_tilt"))]  # fmt: skip
    for name, places, model in cases:
        found, error, sigma = solve(model, places, noisy(model, places, SEEDS))
        rmse = np.sqrt((error**2).mean(axis=0)) / bound(model, places)
        pulls = (error / sigma).std(axis=0)
        inside = (np.abs(error / sigma) < 1.96).mean(axis=0)
        chi2, dof = np.mean([f.chi2 for f in found]), found[0].dof
        ratio = f"{chi2 / dof:6.3f}" if dof else "  none"
        print(f"{name + ', ' + model.tilt:26} {rmse.max():9.3f}   "
              f"{pulls.min():.3f}-{pulls.max():.3f}  {100 * inside.min():.1f}-"
              f"{100 * inside.max():.1f} %  {ratio}")  # fmt: skip


def against_the_print() -> None:
    """Print what the printed two-step solution leaves, beside ours."""
    model, seeds = OFFSET, SEEDS
    y = noisy(model, FIVE_POSITIONS, seeds)
    each = axis_estimates(observed(FIVE_POSITIONS, y[0]))
    u, _ = model.means(FIVE_POSITIONS)
    # the axes' estimates are nearly linear in the means: one gain serves all seeds
    spread = np.std(np.einsum("qnc,snc->sq", each.gain, y - u), axis=0)
    printed = dict(zip(each.names, spread, strict=True))
    _, error, _ = solve(model, FIVE_POSITIONS, y)
    ours = np.sqrt((error**2).mean(axis=0))
    limit, wide = bound(model, FIVE_POSITIONS), bound(model, WIDE_POSITIONS)
    print(f"\nthe paper's five positions, {SIGMA:g} m/s^2")
    print(f"{'':18}   print    ours   bound   bound of ±45°, ±5°")
    rows = [(f"bias {x} (mm/s^2)", f"{x}.bias", i, 1e3) for i, x in enumerate("xyz")]
    rows += [(f"scale {x} (1e-3)", f"{x}.scale", 3 + i, 1e3)
             for i, x in enumerate("xyz")]  # fmt: skip
    rows += [(f"alpha0 by {x} (deg)", f"{x}.alpha0_deg", 6, 1.0) for x in "xyz"]
    rows += [(f"beta0 by {x} (deg)", f"{x}.beta0_deg", 7, 1.0) for x in "yz"]
    for label, name, i, unit in rows:
        print(f"{label:18} {unit * printed[name]:7.3g} {unit * ours[i]:7.3g} "
              f"{unit * limit[i]:7.3g} {unit * wide[i]:9.3g}")  # fmt: skip


def against_bumps() -> None:
    """Print how often one bad position is found, and what it does to the interval."""
    seeds = 100
    print("\none position pushed in a random direction, joint offset of -1°, -1°")
    print(f"{'':10}  size  found  rms pull  95 % interval too short by")
    for name, places in (("six", SIX), ("nine", NINE)):
        for size in (0, 3, 4, 5, 6, 8, 10, 30, 100):
            found, error, sigma = solve(
                OFFSET, places, noisy(OFFSET, places, seeds, size)
            )
            pulls = np.abs(error / sigma)
            guilty = np.arange(seeds) % len(places)
            doubt = np.array([f.info["bad_position"] for f in found])
            share = (doubt[np.arange(seeds), guilty] > 0.5).mean()
            rms = np.sqrt((pulls**2).mean(axis=0)).max()
            short = np.quantile(pulls, 0.95, axis=0).max() / 1.96
            print(
                f"{name:10} {size:4}σ  {100 * share:4.0f} %  {rms:8.2f}  {short:8.2f}"
            )


def speed() -> None:
    """Print the time of one fit."""
    print()
    for name, places in (("five", FIVE_POSITIONS), ("nine", NINE)):
        sessions = [observed(places, u) for u in noisy(OFFSET, places, 50)]
        began = perf_counter()
        for seen in sessions:
            estimate(seen, tilt=OFFSET.tilt)
        each = (perf_counter() - began) / len(sessions)
        print(f"one fit of {name} positions: {1e3 * each:.1f} ms")


def main() -> None:
    """Print all tables."""
    against_the_bound()
    against_the_print()
    against_bumps()
    speed()
