"""The covariance of a mean whose noise is not white, from the window's own data.

y_b                               means of consecutive batches, b = 1 .. B
C = 1 / (B (B - 1)) * sum (y_b - y)(y_b - y)'     covariance of the mean
"""

from __future__ import annotations

import numpy as np

from fieldcal.samples import Array

BATCHES = 24
"""Batches a window is cut into."""


def covariance_of_mean(means: Array) -> Array:
    """Covariance (6, 6) of the mean of cell means (m, 6), nan where not measured."""
    measured = np.isfinite(means).any(axis=0)
    centred = np.where(np.isfinite(means), means - np.nanmean(means, axis=0), 0.0)
    count = min(BATCHES, len(means))
    batches = np.array([part.mean(axis=0) for part in np.array_split(centred, count)])
    spread = np.cov(batches.T) / count if count > 1 else np.full((6, 6), np.nan)
    known = np.outer(measured, measured)
    covariance: Array = np.where(known, spread, np.nan)
    return covariance
