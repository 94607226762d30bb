"""The joint estimate against its bound, its own statements, the print, and bumps."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from fieldcal.planner import Ladder, best_positions
from fieldcal.positions import FIVE, TWO, WIDE, Position
from fieldcal.samples import Array
from fieldcal.solve.design import Model, design, predict
from fieldcal.solve.five_position import axis_estimates
from fieldcal.solve.joint import Solution, estimate, joint
from fieldcal.solve.observations import Observations

G = 9.81
SIGMA = 1e-3
SEEDS = 20_000
TRUTH = np.array([0.12, -0.08, 0.21, 1.004, 0.997, 1.006])
TILT = np.array([-1.0, -1.0])
SIX = (*WIDE, Position.deg(0, 5))
NINE = (*SIX, Position.deg(-22, 0), Position.deg(22, 3), Position.deg(0, -5))
OFFSET = Model("angle_offset")


def truth(model: Model) -> Array:
    """What is put in, in the order of the model."""
    return TRUTH if model.tilt == "none" else np.concatenate([TRUTH, TILT])


def bound(model: Model, places: tuple[Position, ...]) -> Array:
    """Cramer-Rao bound, (p,)."""
    rows = design(model, places, G, x=truth(model)).reshape(-1, len(model.names))
    return SIGMA * np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))


def noisy(
    model: Model, places: tuple[Position, ...], seeds: int, bump: float = 0.0
) -> Array:
    """Means of many sessions, (seeds, n, 3), one position of each pushed by `bump`."""
    rng = np.random.default_rng(1)
    u, _ = predict(model, places, G, np.eye(3), truth(model))
    y = u + SIGMA * rng.standard_normal((seeds, len(places), 3))
    push = rng.standard_normal((seeds, 3))
    push *= bump * SIGMA / np.linalg.norm(push, axis=1, keepdims=True)
    y[np.arange(seeds), np.arange(seeds) % len(places)] += push
    return np.asarray(y)


def solve(
    model: Model, places: tuple[Position, ...], y: Array
) -> tuple[Solution, Array, Array]:
    """Solution, errors and stated uncertainties."""
    noise = np.tile(SIGMA**2 * np.eye(3), (len(places), 1, 1))
    found = estimate(model, places, G, y, noise)
    sigma = np.sqrt(np.diagonal(found.covariance, axis1=-2, axis2=-1))
    return found, found.x - truth(model), sigma


def against_the_bound() -> None:
    """Print rmse over the bound, pulls, coverage and chi2 for three position sets."""
    print(f"{SEEDS} seeds, {SIGMA:g} m/s^2 on each mean")
    print(f"{'positions, tilt':26} rmse/bound  pull std    95 % holds   chi2/dof")
    planned = best_positions(5, Ladder(), G)
    cases = [("two", TWO, Model()), ("five", FIVE, OFFSET), ("wide", WIDE, OFFSET),
             ("planned", planned, OFFSET),
             ("planned", planned, Model("base_tilt"))]  # fmt: skip
    for name, places, model in cases:
        found, error, sigma = solve(model, places, noisy(model, places, SEEDS))
        rmse = np.sqrt((error**2).mean(axis=0)) / bound(model, places)
        pulls = (error / sigma).std(axis=0)
        inside = (np.abs(error / sigma) < 1.96).mean(axis=0)
        ratio = f"{(found.chi2 / found.dof).mean():6.3f}" if found.fit.dof else "  none"
        print(f"{name + ', ' + model.tilt:26} {rmse.max():9.3f}   "
              f"{pulls.min():.3f}-{pulls.max():.3f}  {100 * inside.min():.1f}-"
              f"{100 * inside.max():.1f} %  {ratio}")  # fmt: skip


def against_the_print() -> None:
    """Print what the printed two-step solution leaves, beside ours."""
    model, seeds = OFFSET, 4000
    y = noisy(model, FIVE, seeds)
    mean = np.full((5, 6), np.nan)
    mean[:, :3] = y[0]
    cov = np.tile(np.diag([SIGMA**2] * 3 + [1.0] * 3), (5, 1, 1))
    each = axis_estimates(Observations(FIVE, mean, cov, G))
    u, _ = predict(model, FIVE, G, np.eye(3), truth(model))
    # the axes' estimates are nearly linear in the means: one gain serves all seeds
    spread = np.std(np.einsum("qnc,snc->sq", each.gain, y - u), axis=0)
    printed = dict(zip(each.names, spread, strict=True))
    _, error, _ = solve(model, FIVE, y)
    ours = np.sqrt((error**2).mean(axis=0))
    limit, wide = bound(model, FIVE), bound(model, WIDE)
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
    seeds = 4000
    print("\none position pushed in a random direction, joint offset of -1°, -1°")
    print(f"{'':10}  size  found  rms pull  95 % interval too short by")
    for name, places in (("six", SIX), ("nine", NINE)):
        for size in (0, 3, 4, 5, 6, 8, 10, 30, 100):
            found, error, sigma = solve(
                OFFSET, places, noisy(OFFSET, places, seeds, size)
            )
            pulls = np.abs(error / sigma)
            guilty = np.arange(seeds) % len(places)
            share = (found.bad[np.arange(seeds), guilty] > 0.5).mean()
            rms = np.sqrt((pulls**2).mean(axis=0)).max()
            short = np.quantile(pulls, 0.95, axis=0).max() / 1.96
            print(
                f"{name:10} {size:4}σ  {100 * share:4.0f} %  {rms:8.2f}  {short:8.2f}"
            )


def speed() -> None:
    """Print the time of one fit."""
    y = noisy(OFFSET, FIVE, 2000)
    began = perf_counter()
    solve(OFFSET, FIVE, y)
    batch = (perf_counter() - began) / 2000
    mean = np.full((5, 6), np.nan)
    mean[:, :3] = y[0]
    cov = np.tile(np.diag([SIGMA**2] * 3 + [1.0] * 3), (5, 1, 1))
    seen = Observations(FIVE, mean, cov, G)
    joint(seen, OFFSET)
    began = perf_counter()
    for _ in range(100):
        joint(seen, OFFSET)
    single = (perf_counter() - began) / 100
    print(f"\none fit of five positions: {1e3 * single:.2f} ms alone, "
          f"{1e3 * batch:.3f} ms in a batch of 2000")  # fmt: skip


def main() -> None:
    """Print all tables."""
    against_the_bound()
    against_the_print()
    against_bumps()
    speed()
