"""The Earth's rate in the gyroscopes while a rate table turns.

With the table's rate v in device axes, |v| = v, the part of the Earth's rate w across v
rotates in device axes and averages out over whole turns:

    w_across(t) = a e_1(t) + b e_2(t),   e_i(t) = exp(-[v (t - t_0)]x) e_i(t_0)     (1)

e_1, e_2 are perpendicular to v and to each other. The angle of the table at the start
of the window is not known, so a and b are fitted to the window with the mean, and
subtracted. Means over d seconds are smaller by sin(v d / 2) / (v d / 2). An oscillation
larger than the Earth's rate has another cause and is kept. rad/s, s, device axes.
Source: rotation kinematics.

If the table turns by less than a full turn, by an angle c, the mean contains at most
2 sin(c / 2) / c of the rate across, in an unknown direction:

    cov = (I - v v^T / v^2) 2/3 Omega^2 min(1/2, 1 / c^2)                           (2)

If the axis of the table is not known, only its speed v_i is. The axis then follows from
the measured rates w_i less a bias b, which is found from the norms, linear in b and
|b|^2:

    |w_i|^2 - v_i^2 = 2 b w_i - |b|^2                                               (3)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.positions import Position, table_rates, unknown_axis_speeds
from fieldcal.core.samples import Array, Index
from fieldcal.model import detections, thresholds, tolerances
from fieldcal.model.rows.block_means import mean_of_known
from fieldcal.physics.experience import Experience


def unknown_earth_rate(scale: Array | Sequence[float]) -> Array:
    """Error of gyroscopes by the Earth's rate in unknown orientations, (3,) outputs.

    One standard deviation, for scale factors (3,).
    """
    size: Array = EARTH_RATE / np.sqrt(3) * np.abs(np.asarray(scale))
    return size


@dataclass(frozen=True, slots=True)
class RotatingEarthRate:
    """The part of the Earth's rate that rotates with a table, in one window.

    Attributes
    ----------
    values : (k, 3) in each of the outputs, rad/s; 0 if it is not known
    covariance : (3, 3) of the window's mean after it is subtracted

    """

    values: Array
    covariance: Array


@dataclass(frozen=True, slots=True)
class GyroReadings:
    """Angular rates that the gyroscopes measure in the positions of a session.

    Attributes
    ----------
    positions : of the session
    position : (n,) index of each row's
    w : (n, 3) measured rates, rad/s in device axes; nan where missing
    earth : rad/s, length of the Earth's rate; 0 if the gyroscopes do not measure it

    """

    positions: Sequence[Position]
    position: Index
    w: Array
    earth: float = 0.0

    def rates(self, mounting: Array) -> Array:
        """Rates of a rate table, (n, 3) rad/s about procedure axes.

        If its axis is not known, the direction is that measured in each position.
        `mounting` (3, 3) is P, procedure = P device.
        """
        out: Array = table_rates(self.positions)[self.position]
        speed, _ = unknown_axis_speeds(self.positions)
        if speed.any():
            mean, _ = self._pointing(speed)
            for p in np.flatnonzero(speed):
                out[self.position == p] = speed[p] * (mounting @ _unit(mean[p]))
        return out

    def earth_rates(self) -> Array:
        """The Earth's rate in device axes in rows of unknown orientation, (n, 3).

        Along the measured rate if enough positions determine the bias; else 0.
        """
        out = np.zeros((len(self.position), 3))
        free = [
            p
            for p in np.unique(self.position)
            if not (self.positions[p].oriented or self.positions[p].on_turning_table)
        ]
        if not (self.earth and len(free) >= detections.MIN_EARTH_POSITIONS):
            return out
        speed, _ = unknown_axis_speeds(self.positions)
        mean, known = self._pointing(speed)
        length = np.linalg.norm(mean[free], axis=1) / self.earth
        if known and np.abs(length - 1).max() < detections.MAX_EARTH_MISFIT:
            for p in free:
                out[self.position == p] = self.earth * _unit(mean[p])
        return out

    def with_earth_rates(self, x: Experience) -> Experience:
        """The rows `x` with these rates where no table turns and no angle is known."""
        free = ~x.oriented & ~x.rate.any(axis=1)
        return replace(x, w=np.where(free[:, None], self.earth_rates(), x.w))

    def _pointing(self, speed: Array) -> tuple[Array, bool]:
        """Means of the positions less the bias, and whether that is determined, (3)."""
        mean = np.zeros((len(self.positions), 3))
        held = np.unique(self.position)
        for p in held:
            mean[p] = np.nan_to_num(mean_of_known(self.w[self.position == p]))
        here = [p for p in held if not any(self.positions[p].rate or ())]
        length = np.where(speed > 0, speed, self.earth)
        bias, known = _bias_from_norms(mean[here], length[here])
        mean[here] -= bias
        return mean, known


def _unit(w: Array) -> Array:
    """Unit vector along a rate; an arbitrary one if the rate is 0."""
    length = float(np.linalg.norm(w))
    return w / length if length > 0 else np.array([0.0, 1.0, 0.0])


def _bias_from_norms(w: Array, length: Array) -> tuple[Array, bool]:
    """Bias of rates (p, 3) of known lengths (p,), rad/s, and whether it is determined.

    Zero if it is not, (3).
    """
    size = float(np.abs(w).max(initial=1e-12))
    design = np.column_stack([2 * w / size, -np.ones(len(w))])
    squares = (np.sum(w**2, axis=1) - length**2) / size**2
    solution, _, rank, _ = np.linalg.lstsq(design, squares, detections.MIN_AXES_SPREAD)
    if rank < design.shape[1]:
        return np.zeros(3), False
    return size * solution[:3], True


def fit_rotating_earth_rate(
    t: Array, rate: Array, gyr: Array, sd: Array, scale: Array, length: Array | float
) -> RotatingEarthRate:
    """Fit the part of the Earth's rate that rotates with a table in one window.

    Parameters
    ----------
    t : (k,) instants of the outputs, s
    rate : (3,) of the table, in device axes, rad/s
    gyr, sd : (k, 3) outputs of the gyroscopes, rad/s, and their white noise
    scale : (3,) scale factors of the gyroscopes
    length : (k,) s that each output is a mean over; 0 for samples

    """
    speed = float(np.linalg.norm(rate))
    turned = speed * float(np.ptp(t))
    used = np.isfinite(gyr).all(axis=1) & np.isfinite(sd).all(axis=1)
    none = RotatingEarthRate(
        np.zeros_like(gyr), _unseen_rate_covariance(rate / speed, turned)
    )
    if turned < 2 * np.pi * detections.MIN_REVOLUTIONS or used.sum() < 3:
        return none
    shape = scale[:, None] * _unit_vectors(rate / speed, speed * (t - t[0]))
    shape *= np.broadcast_to(np.sinc(speed * length / (2 * np.pi)), t.shape)[
        :, None, None
    ]
    weight = 1 / sd[used]
    means = np.broadcast_to(np.eye(3), (int(used.sum()), 3, 3))
    design = np.concatenate([means, shape[used]], axis=2) * weight[:, :, None]
    design = design.reshape(-1, 5)
    solution, _, rank, _ = np.linalg.lstsq(
        design, (gyr[used] * weight).ravel(), tolerances.UNDETERMINED
    )
    if rank < design.shape[1]:
        return none
    covariance = np.linalg.inv(design.T @ design)[3:, 3:]
    sigma = float(np.sqrt(covariance.diagonal().max()))
    if np.linalg.norm(solution[3:]) > EARTH_RATE + thresholds.DECIDES * sigma:
        return none
    mean = shape[used].mean(axis=0)
    return RotatingEarthRate(shape @ solution[3:], mean @ covariance @ mean.T)


def _unseen_rate_covariance(axis: Array, turned: float) -> Array:
    """Covariance of the mean if nothing is subtracted, (2)."""
    size = 2 / 3 * EARTH_RATE**2 * min(0.5, 1 / max(turned, 1e-9) ** 2)
    return size * (np.eye(3) - np.outer(axis, axis))


def _unit_vectors(axis: Array, angle: Array) -> Array:
    """Unit vectors e_1 and e_2 of (1) at some angles, (k, 3, 2)."""
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([cos * first - sin * second, sin * first + cos * second], axis=2)
