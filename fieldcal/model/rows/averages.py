"""Averages of samples between bounds: rows, and the inputs of the device in them.

The standard deviation of a mean of n white samples of deviation s is s / sqrt(n).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.core.positions import alpha_beta_angles, attitude_sigmas, gamma_angles
from fieldcal.core.samples import Array, Index, Mask
from fieldcal.core.sampling import sampling_rate
from fieldcal.model.rows.block_means import block_means, masked
from fieldcal.model.rows.orientation import (
    force_from_outputs,
    gyro_readings,
    known_angles,
    known_attitudes,
)
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.turntable import fit_rotating_earth_rate
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.physics.experience import Experience
from fieldcal.physics.joint_turns import JointTurns
from fieldcal.session.site_gravity import gravity_sigma


@dataclass(frozen=True, slots=True)
class Rows:
    """Block means, and the inputs of the device in each.

    Attributes
    ----------
    x : n rows
    y : (n, 6) means, m/s^2 and rad/s; nan where no sample was usable
    sd : (n, 6) standard deviation of each mean from white noise
    window_error : (n, 6) standard deviation of an error that all rows of a window share
    length : (n,) s
    noise : (6,) standard deviation of one sample
    span : (n, 2) instants of the first and the last sample, s
    hand_angle : (n, 3) rms angle by which a hand turns the device about each axis
        within the window, rad
    session_error : (6,) standard deviation of an error that all windows share

    """

    x: Experience
    y: Array
    sd: Array
    window_error: Array
    length: Array
    noise: Array
    span: Array
    hand_angle: Array
    session_error: Array = field(default_factory=lambda: np.zeros(6))

    @property
    def used(self) -> Mask:
        """Means that can be used, (n, 6)."""
        return np.isfinite(self.y) & np.isfinite(self.sd)

    @property
    def error_by_window(self) -> Array:
        """Error that all rows of a window share, of each position held, (p, 6)."""
        first = np.unique(self.x.position, return_index=True)[1]
        return self.window_error[first]

    def without(self, left: Mask) -> Rows:
        """The rows with those marked in `left` (n,) made unusable."""
        return replace(self, sd=np.where(left[:, None], np.nan, self.sd))


def average_rows(
    source: RowSource,
    bound: Index,
    position: Index,
    level: Array,
    noise: Array,
    variance: Array,
) -> Rows:
    """Average samples between bounds to rows.

    Parameters
    ----------
    bound : (n, 2) first and one past the last sample of each row
    position : (n,) index of each row's position
    level : (n, 6) standard deviation of one sample in each row
    noise : (6,) usual standard deviation of one sample
    variance : (n, 3) of the samples of the accelerometers, squares of the outputs

    """
    block = source.block
    y, count = block_means(masked(block, source.usable), bound)
    sd = level / np.sqrt(np.maximum(count, 1))
    # an output that never changes has no information
    informative = (count > 0) & (sd > 0)
    sd = np.where(informative, sd, np.nan)
    span = np.column_stack([block.t[bound[:, 0]], block.t[bound[:, 1] - 1]])
    length = np.diff(bound, axis=1)[:, 0] / sampling_rate(block)
    x = _experience(source, position, y, span.mean(axis=1), length, variance)
    sd[~x.force_known | _lacks_direction(x, y), :3] = np.nan
    scale = source.about.nominal["gyr_scale"]
    _subtract_rotating_earth_rate(x, y[:, 3:], sd[:, 3:], length, scale)
    still = np.zeros((len(y), 3))
    return Rows(x, y, sd, np.zeros_like(sd), length, noise, span, still)


def _lacks_direction(x: Experience, y: Array) -> Mask:
    """Rows of free positions in which an accelerometer was never measured, (n,).

    The other two do not tell where the force points.
    """
    out = np.zeros(len(y), dtype=bool)
    for p in np.unique(x.position[~x.oriented]):
        here = x.position == p
        out[here] = np.isnan(y[here, :3]).all(axis=0).any()
    return out


def _experience(
    source: RowSource,
    position: Index,
    y: Array,
    t: Array,
    length: Array,
    variance: Array,
) -> Experience:
    """Inputs of the device in rows of outputs (n, 6) at t, `length` (n,) s each."""
    about = source.about
    warming, heating = source.thermometer.at(t)
    gyroscopes = gyro_readings(about, position, y[:, 3:])
    x = Experience.at_rest(
        *known_angles(about, position),
        about.gravity,
        f=force_from_outputs(about, position, y[:, :3]),
        t=t,
        lasts=length,
        since_start=t - source.block.t[0],
        since_turn=t - source.rest_began[position],
        passed=source.passed.mean(t, length),
        warming=warming,
        heating=heating,
        variance=np.nan_to_num(variance) / about.nominal["acc_scale"] ** 2,
        position=position,
        rate=gyroscopes.rates(about.mounting),
        base_force=about.base_force,
        base_rate=about.base_rate,
        transport=about.base_motion.rate,
        mounting=about.mounting,
        latitude=about.latitude,
        gravity_sigma=float(np.hypot(gravity_sigma(about), source.sway_gravity_sigma)),
        joint_turns=_joint_turns(source),
        clock_sigma=about.clock_sigma,
        **known_attitudes(about, position),
    )
    return gyroscopes.with_earth_rates(x)


def _joint_turns(source: RowSource) -> JointTurns:
    """Turns of the joints, as far as the positions' angles are known.

    Measured attitudes are not used: their angles are not those of joints. Nor are
    positions without samples: nobody knows when, or whether, the joints went there.
    """
    positions = source.about.positions
    if not positions:
        return JointTurns.none()
    known = np.column_stack([*alpha_beta_angles(positions), gamma_angles(positions)])
    known[np.isfinite(attitude_sigmas(positions))] = np.nan
    held = np.diff(window_bounds(source.block, source.about), axis=1)[:, 0] > 0
    return JointTurns.of(source.rest_began[: len(known)][held], known[held])


def _subtract_rotating_earth_rate(
    x: Experience, gyr: Array, sd: Array, length: Array, scale: Array
) -> None:
    """Subtract the Earth's rate that rotates with a rate table from means (n, 3)."""
    for p in np.unique(x.position[x.rate.any(axis=1)]):
        at = np.flatnonzero(x.position == p)
        rate = x.rate[at[0]] @ x.mounting
        gyr[at] -= fit_rotating_earth_rate(
            x.t[at], rate, gyr[at], sd[at], scale, length[at]
        ).values
