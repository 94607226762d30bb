"""Logs slower than a usual one, whose times in s would make a usual one in ms.

Between two rows of such a log a device may be turned as far as it likes. In the faster
unit it would have been turned faster than any gyroscope measures, and stopped as soon.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

FASTEST = float(np.deg2rad(3000.0))
"""Rate that no hand and no usual gyroscope reaches, rad/s."""

STILL, OFTEN = 0.1, 2
"""Part of its length by which a force stays the same on either side of a turn; turns
that tell."""


def turns_at_once(acc: Array, step: float) -> bool:
    """Whether forces (n, 3) turn from rest to rest faster than anything is turned.

    Parameters
    ----------
    acc : in any unit
    step : s from row to row, in the unit of time that is in doubt

    >>> acc = np.repeat(np.eye(3), 20, axis=0)
    >>> turns_at_once(acc, 0.002), turns_at_once(acc, 2.0)
    (True, False)
    """
    known = acc[np.isfinite(acc).all(axis=1)]
    length = np.linalg.norm(known, axis=1)
    way = known[length > 0] / length[length > 0, None]
    if len(way) < 2 * OFTEN + 1:
        return False
    # two rows before a row, and two behind it, each pair at rest
    before, behind = way[1:-3], way[3:-1]
    cosine = np.clip((before * behind).sum(axis=1), -1.0, 1.0)
    rests = np.linalg.norm(np.diff(way, axis=0), axis=1) < STILL
    fast = np.arccos(cosine) > FASTEST * 2 * step
    return bool((fast & rests[:-3] & rests[3:]).sum() >= OFTEN)
