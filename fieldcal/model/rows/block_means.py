"""Means of samples between bounds, without unusable ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Block, Index, Mask
from fieldcal.model import resolutions


def masked(block: Block, usable: Mask) -> Block:
    """Samples with nan for those that may not be used; the block itself if all may."""
    if usable.all():
        return block
    new = {}
    for name, may in (("acc", usable[:, :3]), ("gyr", usable[:, 3:])):
        triad = getattr(block, name)
        if (np.isfinite(triad) & ~may).any():
            new[name] = np.where(may, triad, np.nan)
    return replace(block, **new) if new else block


def block_means(block: Block, bound: Index) -> tuple[Array, Index]:
    """Means between bounds, (n, 6), and how many samples are in each, (n, 6)."""
    parts = [_triad_means(triad, bound) for triad in (block.acc, block.gyr)]
    mean, count = (np.hstack(both) for both in zip(*parts, strict=True))
    return mean, count


def _triad_means(triad: Array, bound: Index) -> tuple[Array, Index]:
    centre = np.nan_to_num(
        _middle(triad[bound[0, 0] : bound[0, 1] : resolutions.CENTRE_EVERY])
    )
    mean, count = np.empty((len(bound), 3)), np.empty((len(bound), 3), dtype=np.intp)
    # window by window: what is taken at a time stays small
    gaps = np.flatnonzero(bound[1:, 0] != bound[:-1, 1]) + 1
    for rows in np.split(np.arange(len(bound)), gaps):
        first, last = bound[rows[0], 0], bound[rows[-1], 1]
        shifted = triad[first:last] - centre
        starts = bound[rows, 0] - first
        known = np.isfinite(shifted)
        if known.all():
            count[rows] = np.diff(bound[rows], axis=1)
        else:
            shifted[~known] = 0.0
            count[rows] = np.add.reduceat(known, starts, axis=0, dtype=np.intp)
        total = np.add.reduceat(shifted, starts, axis=0)
        mean[rows] = total / np.maximum(count[rows], 1) + centre
    return np.where(count > 0, mean, np.nan), count


def mean_of_known(values: Array) -> Array:
    """Mean of each column over what is known, nan where nothing is.

    >>> mean_of_known(np.array([[1.0, np.nan], [3.0, np.nan]]))
    array([ 2., nan])
    """
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=0)
    mean: Array = total / np.where(known.any(axis=0), known.sum(axis=0), np.nan)
    return mean


def _middle(values: Array) -> Array:
    """Median of each column over what is known, nan where nothing is."""
    out = np.full(values.shape[1], np.nan)
    for c, column in enumerate(values.T):
        known = column[np.isfinite(column)]
        out[c] = np.median(known) if len(known) else np.nan
    return out
