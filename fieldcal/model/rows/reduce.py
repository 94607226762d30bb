"""Samples to block means: the rows that every hypothesis is fitted to.

Each window is cut into blocks (`window_bounds`), so that a hypothesis costs
milliseconds however long the recording is. The standard deviation of a mean of n
white samples of deviation s is s / sqrt(n); s is measured in the recording (`noise`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.positions import alpha_beta_angles, attitude_sigmas, gamma_angles
from fieldcal.core.samples import Array, Block
from fieldcal.core.sampling import sampling_rate
from fieldcal.model.rows.block_means import block_means, masked
from fieldcal.model.rows.noise import rounding_sigma, shared_rounding_sigma
from fieldcal.model.rows.orientation import (
    force_from_outputs,
    gyro_readings,
    known_angles,
    known_attitudes,
)
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.rows.turntable import fit_rotating_earth_rate
from fieldcal.model.rows.vibration import WindowNoise, measure_window_noise
from fieldcal.model.rows.window_bounds import block_bounds, window_bounds
from fieldcal.physics.experience import Experience
from fieldcal.physics.joint_turns import JointTurns
from fieldcal.session.description import Description
from fieldcal.session.site_gravity import gravity_sigma
from fieldcal.windows.dead_band import dead_bands, error_of_means


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
    def used(self) -> NDArray[np.bool_]:
        """Means that can be used, (n, 6)."""
        return np.isfinite(self.y) & np.isfinite(self.sd)

    def without(self, left: NDArray[np.bool_]) -> Rows:
        """The rows with those marked in `left` (n,) made unusable."""
        return replace(self, sd=np.where(left[:, None], np.nan, self.sd))


@dataclass(frozen=True)
class RowSource:
    """Samples of a session, with what is needed to reduce them to rows.

    Attributes
    ----------
    block : the samples, corrected
    about : description of the session
    usable : (n, 6) samples that may be used
    rest_began : (p,) instant from which the device was at rest in each position, s
    thermometer : the temperature
    pace : seconds of the device's clock in a true second
    sway_variance : (p, 6) variance of each window's mean that remains after a base's
        sway was subtracted, SI squared; None if the base does not sway
    sway_noise : (6,) standard deviation of one sample on such a base; the subtraction
        removes slow noise as well
    sway_gravity_sigma : m/s^2, standard deviation of the apparent loss of gravity by
        sway

    """

    block: Block
    about: Description
    usable: NDArray[np.bool_]
    rest_began: Array
    thermometer: Thermometer
    pace: float = 1.0
    sway_variance: Array | None = None
    sway_noise: Array | None = None
    sway_gravity_sigma: float = 0.0

    @property
    def complete_samples(self) -> RowSource:
        """The source with only those samples whose outputs are all usable.

        Unchanged if there are no such samples, or no others.
        """
        every = self.usable.all(axis=1)
        if every.all() or not every.any():
            return self
        kept = {f.name: getattr(self.block, f.name)[every] for f in fields(Block)}
        return replace(self, block=Block(**kept), usable=self.usable[every])

    @cached_property
    def rate(self) -> float:
        """Samples a second."""
        return sampling_rate(self.block)

    @cached_property
    def window_noise(self) -> WindowNoise:
        """Noise of the windows that have samples."""
        block = masked(self.block, self.usable)
        windows = window_bounds(block, self.about)
        held = np.diff(windows, axis=1)[:, 0] > 1
        return measure_window_noise(block, windows[held], self.rate)


def reduce_to_rows(
    source: RowSource,
    whole: bool | NDArray[np.bool_] = False,
    level: Array | None = None,
    apart: bool = False,
) -> Rows:
    """Cut the windows into blocks and average them.

    Parameters
    ----------
    source : samples and windows
    whole : whether a window is one row, as of a device that is held by hand, of each
        position (p,) or of all
    level : (6,) standard deviation of one sample in these; if None, it is measured in
        each window, as in the others
    apart : whether the blocks are for the accelerometers only, and each window has a
        further row, its last, for the gyroscopes

    """
    block = masked(source.block, source.usable)
    cut = _CutWindows.of(source, block, whole, apart)
    out = _average_windows(source, cut, level)
    off, alike = _errors_of_values(block, cut.windows, out.y, cut.rows)
    off = _with_errors_of_site(source, out.x, off, len(cut.windows) > 1)
    if apart:
        ends = np.zeros(len(off), dtype=bool)
        ends[np.cumsum(cut.rows) - 1] = True
        out.sd[ends, :3] = np.nan
        out.sd[~ends, 3:] = np.nan
    return replace(out, window_error=off, session_error=alike)


@dataclass(frozen=True, slots=True)
class _CutWindows:
    """The w windows that have samples, cut into blocks.

    Attributes
    ----------
    windows : (w, 2) first and one past the last sample of each window
    position : (w,) index of each window's position
    whole : (w,) whether it is one row
    bounds : (r, 2) first and one past the last sample of the rows of each window

    """

    windows: NDArray[np.intp]
    position: NDArray[np.intp]
    whole: NDArray[np.bool_]
    bounds: list[NDArray[np.intp]]

    @classmethod
    def of(
        cls,
        source: RowSource,
        block: Block,
        whole: bool | NDArray[np.bool_],
        apart: bool,
    ) -> _CutWindows:
        """Cut the windows of `block`, the source's samples that may be used.

        `whole` and `apart` are those of `reduce_to_rows`.
        """
        windows = window_bounds(block, source.about)
        held = np.flatnonzero(np.diff(windows, axis=1)[:, 0] > 1)
        rate, without = source.rate, source.about.excluded_spans
        one, bounds = np.broadcast_to(whole, len(windows))[held], []
        for (a, b), alone in zip(windows[held].tolist(), one.tolist(), strict=True):
            each = np.zeros((0, 2), dtype=np.intp)
            if not alone:
                each = block_bounds(block.t, (a, b), rate, len(held), without)
            bounds.append(np.vstack([each, [(a, b)]]) if alone or apart else each)
        return cls(windows[held], held, one, bounds)

    @property
    def rows(self) -> list[int]:
        """Number of rows of each window."""
        return [len(b) for b in self.bounds]


def _average_windows(source: RowSource, cut: _CutWindows, level: Array | None) -> Rows:
    """Average the blocks of windows, with the noise that the samples have.

    `level` (6,) is the standard deviation of one sample in windows that are one row;
    if None, and in the others, that of each window, and at least that of a base that
    sways.
    """
    shaken, rows = source.window_noise, cut.rows
    noise, levels = shaken.noise, shaken.levels
    if source.sway_noise is not None:
        noise, levels = (np.fmax(a, source.sway_noise) for a in (noise, levels))
    if level is not None:
        noise, levels = level, np.where(cut.whole[:, None], level, levels)
    return average_rows(
        replace(source, block=shaken.block),
        np.concatenate(cut.bounds),
        np.repeat(cut.position, rows),
        np.repeat(levels, rows, axis=0),
        noise,
        np.repeat(shaken.variance, rows, axis=0),
    )


def _with_errors_of_site(
    source: RowSource, x: Experience, off: Array, turned: bool
) -> Array:
    """Add what sway and an unknown direction of the Earth's rate do to whole windows.

    Parameters
    ----------
    x : inputs of the device in n rows
    off : (n, 6) standard deviations of the other errors that all rows of a window
        share, m/s^2 and rad/s
    turned : whether there is more than one window

    """
    if source.sway_variance is not None:
        off = np.hypot(off, np.sqrt(source.sway_variance[x.position]))
    # the direction of the Earth's rate is unknown in device axes, except in a device
    # that was never turned (bias contains it) or whose gyroscopes measure it
    free = x.earth_unseen & turned
    earth = EARTH_RATE / 3**0.5 * np.abs(source.about.nominal["gyr_scale"])
    off[free, 3:] = np.hypot(off[free, 3:], earth)
    return off


def _errors_of_values(
    block: Block, windows: NDArray[np.intp], y: Array, rows: Sequence[int]
) -> tuple[Array, Array]:
    """Errors by rounding and dead bands, which no average makes smaller.

    Parameters
    ----------
    windows, rows : (w, 2) samples of each window, and its number of rows
    y : (n, 6) means of the rows

    Returns
    -------
    Standard deviations of what all rows of a window share, (n, 6), and of what all
    windows share, (6,).

    """
    rounded = rounding_sigma(block, windows)
    alike = shared_rounding_sigma(block, windows, rounded)
    off = np.repeat(rounded, rows, axis=0)
    hidden = error_of_means(y, dead_bands(block))
    off[:, :3] = np.hypot(off[:, :3], hidden[:, :3])
    # what a band hides of a gyroscope at rest is the same in each window
    alike[3:] = np.hypot(alike[3:], hidden[:, 3:].max(axis=0, initial=0.0))
    return off, alike


def average_rows(
    source: RowSource,
    bound: NDArray[np.intp],
    position: NDArray[np.intp],
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


def _lacks_direction(x: Experience, y: Array) -> NDArray[np.bool_]:
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
    position: NDArray[np.intp],
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
