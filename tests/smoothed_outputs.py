"""Outputs of a device that is held still between turns, and smoothed by a program."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Index

WINDOW, PAUSE = 2000, 300
"""Samples of a rest, and of a turn."""

NOISE = 0.02


def smoothed(x: Array, kept: float) -> Array:
    """Sample by sample, as a program does it."""
    out = x.copy()
    for n in range(1, len(x)):
        out[n] = kept * out[n - 1] + (1 - kept) * x[n]
    return out


def held(
    seed: int, windows: int = 4, jump: float = 5.0, early: int = 0, noise: float = NOISE
) -> tuple[Array, Index]:
    """Outputs (n, 3) of a device held still between turns, and its windows.

    A window begins `early` samples before its turn ends.
    """
    rng = np.random.default_rng(seed)
    level, parts, bounds, n = rng.normal(0, jump, 3), [], [], 0
    for _ in range(windows):
        new = rng.normal(0, jump, 3)
        way = np.linspace(0, 1, PAUSE)[:, None]
        parts += [level + way * (new - level), np.tile(new, (WINDOW, 1))]
        bounds.append((n + PAUSE - early, n + PAUSE + WINDOW))
        level, n = new, n + PAUSE + WINDOW
    x = np.vstack(parts)
    return x + noise * rng.normal(size=x.shape), np.array(bounds, dtype=np.intp)
