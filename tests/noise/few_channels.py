"""Samples of a device of which few channels were measured."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array


def only(values: Array, *channels: int) -> Array:
    """The same samples (n, 6), of which the other channels were not measured."""
    out: Array = np.full_like(values, np.nan)
    out[:, channels] = values[:, channels]
    return out
