"""The search for the noise of a navigator's runs, by the evidence of their rows.

Noise that is far too small changes no row, so the evidence is as flat there as at its
maximum. Each noise in turn is therefore set to its best value over its range, and
the search climbs from there by the slopes of `run_rows`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.navigator.run_rows import RunRows, evidence_slopes, run_posterior

NOISE_LEAST = (1e-6, 1e-8, 1e-6, 1e-6, 1e-6)
NOISE_MOST = (0.1, 1e-2, 10.0, 10.0, 0.3)
"""Bounds of N_a (m/s^2/sqrt(Hz)), N_g (rad/s/sqrt(Hz)), q_v (m/s), q_p (m) and J
(m/s^2)."""

SEARCH_TOLERANCE = {"gtol": 0.02}
"""Tolerance of the search for the noise of (2): slope of log evidence by ln of each."""

SIZES_TRIED = 12
"""Number of sizes of each noise that are tried, over its range."""

LEAST_RISE = 0.02
"""Rise of log evidence below which the search for the noise ends."""


def likeliest_noise(rows: Sequence[RunRows], sizes: Array, near: Array | None) -> Array:
    """Noise of the greatest evidence, (5,) as in (2); `near` is the start value.

    The same from any start.
    """
    from scipy.optimize import minimize

    acts = _noise_that_acts(rows)
    least, most = np.log(NOISE_LEAST)[acts], np.log(NOISE_MOST)[acts]

    def with_noise(logs: Array) -> Array:
        out = np.array(NOISE_LEAST)
        out[acts] = np.exp(logs)
        return out

    def worse(logs: Array) -> tuple[float, Array]:
        noise = with_noise(logs)
        found = run_posterior(rows, sizes, noise)
        return -found.score, -evidence_slopes(rows, found, noise)[acts]

    def score(logs: Array) -> float:
        return run_posterior(rows, sizes, with_noise(logs)).score

    def climbed(start: Array) -> Array:
        found = minimize(
            worse,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=list(zip(least, most, strict=True)),
            options=SEARCH_TOLERANCE,
        )
        return np.asarray(found.x)

    before = -np.inf
    logs: Array = (least + most) / 2 if near is None else np.log(near[acts])
    while (now := score(logs)) - before > LEAST_RISE:
        before = now
        logs = climbed(_best_sizes_one_by_one(score, logs, least, most))
    return with_noise(logs)


def _best_sizes_one_by_one(
    score: Callable[[Array], float], logs: Array, least: Array, most: Array
) -> Array:
    """The logarithms with each in turn at its best value over its range."""
    best: Array = logs.copy()
    for i, (low, high) in enumerate(zip(least, most, strict=True)):
        tried = [best.copy() for _ in range(SIZES_TRIED)]
        for one, value in zip(tried, np.linspace(low, high, SIZES_TRIED), strict=True):
            one[i] = value
        best = max([best, *tried], key=score)
    return best


def _noise_that_acts(rows: Sequence[RunRows]) -> NDArray[np.bool_]:
    """Which noise of (2) the rows depend on, (5,): q only of what was recorded."""
    of_position = np.concatenate([one.is_position for one in rows])
    return np.array([True, True, not of_position.all(), of_position.any(), True])
