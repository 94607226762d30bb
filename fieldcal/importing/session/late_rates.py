"""Whether gyroscopes read each turn later or earlier than accelerometers.

Gravity changes in the device by as much as it turns, so that the change of the
accelerometers' means from one interval to the next and the rates rise together. Times
of two clocks, or of a buffer, shift the one against the other. If one shift fits best
in every part of a recording, it is no chance.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.windows.cells import CELL, CellRows
from fieldcal.windows.rests import cell_table

MOST = 20
"""Intervals of the longest shift that is looked for: 2 s."""

LEAST = 2
"""Those of the shortest one that is said: of one, either sensor may be filtered."""

PARTS = 4
"""Parts of a recording that have as much of its turns each, and must agree."""

MOST_FOR_MEDIAN = 1 << 14
"""Intervals of which the median is taken at most."""

_AT_ONCE = 4096
"""Intervals that are read together."""


def late_rates(rows: CellRows) -> str:
    """Say how much later turns are in the rates than in the forces, or nothing.

    Parameters
    ----------
    rows : of all of a recording

    """
    shifts = _best_shifts(*_activities(rows))
    if not len(shifts) or np.abs(shifts).min() < LEAST or np.ptp(shifts) > 1:
        return ""
    if np.abs(shifts).max() == MOST:
        return ""
    shift = float(shifts.mean()) * CELL
    return (
        f"its gyroscopes read each turn {abs(shift):.1f} s"
        f" {'later' if shift > 0 else 'earlier'} than its accelerometers: their times"
        " are of two clocks, or one waits in a buffer; shift the times of one of them"
        " and import it again, or let each rest last much longer than that"
    )


def _activities(rows: CellRows) -> tuple[Array, Array]:
    """Changes of the force and rates from interval to interval, (n,) each.

    Beside a pause, and where either sensor has no value, both are 0. No more than these
    two numbers of an interval is kept: there are 10 of them a second.
    """
    at_rest = _median_rate(rows)
    if np.isnan(at_rest).any():
        return np.empty(0), np.empty(0)
    out = np.zeros((2, max(len(rows) - 1, 0)), dtype=np.float32)
    for first in range(0, len(rows) - 1, _AT_ONCE):
        cells = cell_table(rows[first : first + _AT_ONCE + 1], np.zeros(6))
        t, six = cells.times, cells.means
        change = np.linalg.norm(np.diff(six[:, :3], axis=0), axis=1)
        between = (six[1:, 3:] + six[:-1, 3:]) / 2 - at_rest
        both = np.stack([change, np.linalg.norm(between, axis=1)])
        known = np.isfinite(both).all(axis=0) & (np.diff(t) < 2 * CELL)
        out[:, first : first + _AT_ONCE] = np.where(known, both, 0.0)
    return out[0], out[1]


def _median_rate(rows: CellRows) -> Array:
    """Rates (3,) that the gyroscopes read for most of a recording; nan without any."""
    stride = len(rows) // MOST_FOR_MEDIAN + 1
    some = [
        cell_table(rows[first : first + _AT_ONCE], np.zeros(6)).means[::stride]
        for first in range(0, len(rows), _AT_ONCE)
    ]
    six = np.concatenate([np.empty((0, 6)), *some])
    if not np.isfinite(six).all(axis=1).any():
        return np.full(3, np.nan)
    out: Array = np.nanmedian(six[:, 3:], axis=0)
    return out


def _best_shifts(changes: Array, rates: Array) -> Array:
    """Intervals by which the rates are later where both fit best, in each part."""
    many = len(rates) - 2 * MOST
    if many < 2 * MOST or not rates[MOST:-MOST].any():
        return np.empty(0)
    middle = changes[MOST:-MOST] - changes.mean()
    total = np.cumsum(rates[MOST:-MOST])
    edges = np.searchsorted(total, total[-1] * np.arange(PARTS) / PARTS)
    if len({*edges}) < PARTS:
        return np.empty(0)
    fits = [
        np.add.reduceat(middle * rates[k : k + many], edges)
        for k in range(2 * MOST + 1)
    ]
    shifts: Array = np.argmax(fits, axis=0) - float(MOST)
    return shifts
