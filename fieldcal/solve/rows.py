"""Rows of windows that are known by their means alone, one for each.

A recording has several rows for each window (`model.reduce`); of a table of means, or
while a procedure is under way, the means with their covariances are all there is.
"""

from __future__ import annotations

import numpy as np

from fieldcal.effects import Experience
from fieldcal.frames import EARTH_RATE, force_home
from fieldcal.model.reduce import Rows, free_force
from fieldcal.positions import rates
from fieldcal.samples import ACC, Array
from fieldcal.solve.estimation import Recorded
from fieldcal.solve.observations import Mask, Observations


def of_means(seen: Observations) -> Recorded:
    """One row for each window; correlations between outputs are not kept."""
    n, nominal = len(seen), seen.nominal
    index = np.arange(n)
    y = seen.mean.copy()
    variance = np.einsum("nii->ni", seen.covariance)
    sd = np.sqrt(np.where(variance > 0, variance, np.nan))
    apart = (y[:, :3] - nominal.acc_bias) / np.array(nominal.acc_scale)
    # any direction will do where the accelerometers say nothing
    apart[~np.isfinite(apart).all(axis=1)] = force_home(seen.gravity)
    x = Experience.at_rest(
        *seen.angles,
        seen.gravity,
        f=free_force(seen.gravity, index, apart),
        t=np.where(np.isfinite(seen.time), seen.time, index),
        position=index,
        rate=rates(seen.positions),
        base_force=force_home(seen.gravity),
        mounting=seen.mounting,
        latitude=np.nan if seen.latitude is None else seen.latitude,
    )
    sd[~x.force_known, :3] = np.nan
    _along(seen, x.f, ~x.oriented, sd)
    common = np.zeros_like(sd)
    common[~x.oriented, 3:] = unseen_earth(nominal.gyr_scale) * (n > 1)
    level = np.median(sd, axis=0)
    span = np.column_stack([x.t, x.t])
    rows = Rows(x, y, sd, common, np.ones(n), level, span)
    return Recorded(rows, np.full((1, n), np.inf))


def _along(seen: Observations, f: Array, free: Mask, sd: Array) -> None:
    """Of windows (n,) whose orientation is free, the noise along the force alone.

    A device that turns a little at rest, as in a hand, is unsteady across it, and that
    its free orientation takes up.
    """
    up = f[free] / np.linalg.norm(f[free], axis=1, keepdims=True)
    along = np.einsum("ni,nij,nj->n", up, seen.covariance[free, ACC, ACC], up)
    sd[free, :3] = np.where(np.isfinite(sd[free, :3]), np.sqrt(along)[:, None], np.nan)


def unseen_earth(scale: Array | tuple[float, ...]) -> Array:
    """What the Earth's rate adds where orientations are not known, (3,) outputs."""
    size: Array = EARTH_RATE / np.sqrt(3) * np.abs(np.asarray(scale))
    return size
