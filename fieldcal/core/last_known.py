"""Values of which missing ones are those before them."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array


def last_known(values: Array) -> Array:
    """Values (n, ...), of which a missing one is the last known one, or 0.

    >>> last_known(np.array([np.nan, 2.0, np.nan, 3.0])).tolist()
    [0.0, 2.0, 2.0, 3.0]
    """
    known = np.isfinite(values)
    if known.all():
        return values.copy()
    rows = np.arange(len(values)).reshape(-1, *[1] * (values.ndim - 1))
    last = np.maximum.accumulate(np.where(known, rows, 0), axis=0)
    out: Array = np.nan_to_num(np.take_along_axis(values, last, axis=0))
    return out
