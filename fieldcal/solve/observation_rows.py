"""Rows of windows of which only the means are known: one row for each window.

A recording has several rows for each window (`model.rows.reduce`). A table of means,
and a procedure that is still running, have only the means and their covariances. If
the time of any mean is not known, all count as taken at the same time, and no effect
that depends on time can be found.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.calibration import Nominal
from fieldcal.core.frames import EARTH_RATE, earth_rate_at_home, specific_force_at_home
from fieldcal.core.positions import attitude_sigmas, gamma_angles, unknown_axis_speeds
from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.orientation import force_along_mean
from fieldcal.model.rows.turntable import GyroReadings, unknown_earth_rate
from fieldcal.physics.experience import Experience
from fieldcal.solve.estimation import RecordedRows
from fieldcal.solve.observations import Observations


def rows_of_observations(observations: Observations) -> RecordedRows:
    """One row for each window; correlations between its six outputs are dropped."""
    n, nominal = len(observations), observations.nominal
    index = np.arange(n)
    time = observations.time
    if not np.isfinite(time).all():
        time = np.zeros(n)
    y = observations.mean.copy()
    variances = mean_variances(observations)
    sd = np.sqrt(np.where(variances > 0, variances, np.nan))
    read = GyroReadings(
        observations.positions,
        index,
        (y[:, GYR] - nominal.gyr_bias) / np.array(nominal.gyr_scale),
        _earth_rate_at_rest(observations),
    )
    x = Experience.at_rest(
        *observations.angles,
        observations.gravity,
        f=_measured_force(observations),
        t=time,
        since_start=time - time.min(),
        position=index,
        gamma=gamma_angles(observations.positions),
        attitude_sigma=attitude_sigmas(observations.positions),
        rate=read.rates(observations.mounting),
        speed=unknown_axis_speeds(observations.positions)[0],
        speed_sigma=unknown_axis_speeds(observations.positions)[1],
        base_force=specific_force_at_home(observations.gravity)
        + observations.base_motion.force * [1.0, 0.0, 1.0],
        transport=observations.base_motion.rate,
        mounting=observations.mounting,
        latitude=np.nan if observations.latitude is None else observations.latitude,
    )
    x = read.with_earth_rates(x)
    sd[~x.force_known, :3] = np.nan
    common = np.zeros_like(sd)
    common[x.earth_unseen, 3:] = unknown_earth_rate(nominal.gyr_scale) * (n > 1)
    level = np.median(sd, axis=0)
    span = np.column_stack([x.t, x.t])
    rows = Rows(x, y, sd, common, np.ones(n), level, span, np.zeros(n))
    return RecordedRows(rows, np.full((1, n), np.inf))


def without_angles(rows: Rows, nominal: Nominal) -> Rows:
    """Rows with unknown orientation: the force is along the measured one.

    Rows on a turning table, or without accelerometers, keep their force.
    """
    x, nowhere = rows.x, np.full(len(rows.x), np.nan)
    apart = (rows.y[:, ACC] - nominal.acc_bias) / np.array(nominal.acc_scale)
    still = np.isfinite(apart).all(axis=1) & ~x.rate.any(axis=1)
    read = force_along_mean(x.gravity, x.position, np.where(still[:, None], apart, x.f))
    f = np.where(still[:, None], read, x.f)
    return replace(rows, x=replace(x, alpha=nowhere, beta=nowhere, f=f))


def mean_variances(observations: Observations) -> Array:
    """Variances of the means, (n, 6).

    If the orientation is unknown, that along the force is taken for all three axes: the
    motion of a device held in a hand is across it, and changes only the orientation.
    """
    out: Array = np.einsum("nii->ni", observations.covariance).copy()
    free = ~observations.oriented & np.isfinite(observations.mean[:, ACC]).all(axis=1)
    f = _measured_force(observations)[free]
    up = f / np.linalg.norm(f, axis=1, keepdims=True)
    along = np.einsum("ni,nij,nj->n", up, observations.covariance[free, ACC, ACC], up)
    out[free, ACC] = along[:, None]
    return out


def with_window_variances(rows: Rows, known: Array) -> Rows:
    """Rows whose windows have means of given variances `known`, (p, 6).

    The part beyond white noise is an error that all rows of a window have in common.
    """
    common = rows.window_error.copy()
    for p in np.unique(rows.x.position):
        at = rows.x.position == p
        information = np.where(rows.used[at], 1 / rows.sd[at] ** 2, 0.0).sum(axis=0)
        white = 1 / np.maximum(information, 1e-300)
        beyond = np.maximum(np.nan_to_num(known[p]) - white, 0.0)
        common[at] = np.maximum(common[at], np.sqrt(beyond))
    return replace(rows, window_error=common)


def _earth_rate_at_rest(observations: Observations) -> float:
    """Size of the angular rate at rest, rad/s; 0 if gyroscopes do not resolve it."""
    if observations.grade != "navigation":
        return 0.0
    if observations.latitude is None:
        return EARTH_RATE
    rate = earth_rate_at_home(observations.latitude) + observations.base_motion.rate
    return float(np.linalg.norm(rate))


def _measured_force(observations: Observations) -> Array:
    """Force along the measured one, (n, 3) m/s^2.

    The direction is arbitrary where it was not measured.
    """
    nominal = observations.nominal
    apart = (observations.mean[:, ACC] - nominal.acc_bias) / np.array(nominal.acc_scale)
    apart[~np.isfinite(apart).all(axis=1)] = specific_force_at_home(
        observations.gravity
    )
    return force_along_mean(observations.gravity, np.arange(len(observations)), apart)
