"""What a device would have put out, had its sensors felt something more.

Its outputs are whole steps, and stop at its rails. A change d of an output U that was
rounded to steps q becomes

    U + q round(d / q + u),   u even in (-1/2, 1/2)

as what the rounding had cut off is not known: right in the mean, whatever d is.
Samples at a rail stay there. A text has its outputs in few decimals, and so have those
that are changed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array

FEWEST, MORE = 5, 4.0
"""Samples that make a rail, if they are so many more than at the value next to it."""

DECIMALS = range(10)
"""Of a text; what has more is no decimal number."""

NEAR = 20.0
"""Steps within which gaps tell a grid; a text's decimals add up over wider ones."""


def grid(values: Array) -> float:
    """Step that all values are multiples of, 0 where there is none.

    Zero is not looked at: what was cut off towards it, half a step mends but there.

    >>> round(grid(np.array([0.0, 0.3, 0.9, 1.2, 2.1])), 6)
    0.3
    """
    levels = np.unique(values[np.isfinite(values) & (values != 0)])
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * np.abs(levels).max(initial=0.0)]
    if not len(gaps):
        return 0.0
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    near = gaps[gaps < NEAR * step]
    step = float(near.sum() / np.round(near / step).sum())
    off = np.abs(near / step - np.round(near / step))
    return step if float(off.max()) < 0.1 else 0.0


def on_grid(before: Array, more: Array, step: float) -> Array:
    """Values so many whole steps further, each written as the text writes it.

    >>> on_grid(np.array([0.33, 0.67, 1.0]), np.array([1.0, 0.0, 1.0]), 1 / 3)
    array([0.67, 0.67, 1.33])
    """
    known = np.isfinite(before)
    levels = np.unique(before[known])
    at = np.round((levels - levels[0]) / step)
    count = np.round((before - levels[0]) / step) + more
    wanted = np.unique(count[known])
    written = in_decimals(levels[0] + wanted * step, levels)
    there = np.isin(wanted, at)
    written[there] = levels[np.searchsorted(at, wanted[there])]
    out = np.full(len(before), np.nan)
    out[known] = written[np.searchsorted(wanted, count[known])]
    return out


def in_decimals(changed: Array, before: Array) -> Array:
    """Values in as many decimals as a text had before; as they are if it had none.

    >>> in_decimals(np.array([0.30213]), np.array([0.3, 0.32]))
    array([0.3])
    """
    for d in DECIMALS:
        if np.allclose(before, np.round(before, d), rtol=1e-9, atol=1e-13):
            return np.round(changed, d)
    return changed


def rails(values: Array) -> tuple[float, float]:
    """Lowest and highest value that a channel can put out, as far as it shows."""
    levels, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    if len(levels) < 3:
        return -np.inf, np.inf
    low, high = (
        counts[end] >= max(FEWEST, MORE * counts[beside])
        for end, beside in ((0, 1), (-1, -2))
    )
    return float(levels[0]) if low else -np.inf, float(levels[-1]) if high else np.inf


def put_out(six: Array, change: Array, rng: np.random.Generator) -> Array:
    """Outputs (n, 6) of a device whose sensors felt a change (n, 6) more."""
    out = six + change
    for c in np.flatnonzero(np.abs(np.nan_to_num(change)).max(axis=0) > 0):
        step = grid(six[:, c])
        if step > 0:
            unknown = rng.uniform(-0.5, 0.5, len(six))
            more = np.round(change[:, c] / step + unknown)
            out[:, c] = on_grid(six[:, c], more, step)
        low, high = rails(six[:, c])
        there: NDArray[np.bool_] = (six[:, c] <= low) | (six[:, c] >= high)
        out[:, c] = np.where(there, six[:, c], np.clip(out[:, c], low, high))
    return out
