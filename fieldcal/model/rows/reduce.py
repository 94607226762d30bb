"""Samples to block means: the rows that every hypothesis is fitted to.

Each window is cut into blocks (`bounds`), so that a hypothesis costs milliseconds
however long the recording is. The standard deviation of a mean of n
white samples of deviation s is s / sqrt(n); s is measured in the recording (`noise`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.positions import angles, attitude_sigmas, third_angles
from fieldcal.core.samples import Array, Block
from fieldcal.core.sampling import rate_of
from fieldcal.model.rows.block_means import block_means, masked
from fieldcal.model.rows.bounds import block_bounds, spans
from fieldcal.model.rows.noise import rounding, rounding_alike
from fieldcal.model.rows.orientation import (
    force_read,
    known_angles,
    known_attitudes,
    readings,
)
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.rows.turntable import going_round
from fieldcal.model.rows.vibration import Shaking, shaking
from fieldcal.physics.experience import Experience
from fieldcal.physics.joint_turns import JointTurns
from fieldcal.session.description import Description
from fieldcal.session.site_gravity import gravity_sigma


@dataclass(frozen=True, slots=True)
class Rows:
    """Block means and what the device goes through in each.

    Attributes
    ----------
    x : n rows
    y : (n, 6) means, m/s^2 and rad/s; nan where nothing was usable
    sd : (n, 6) standard deviation of each mean from white noise
    common : (n, 6) standard deviation of an error that all rows of a window share
    length : (n,) s
    noise : (6,) standard deviation of one sample
    span : (n, 2) instants of the first and the last sample, s
    wander : (n, 3) rms angle by which a hand turns the device about each of its axes
        within the window, rad
    alike : (6,) standard deviation of an error that all windows share

    """

    x: Experience
    y: Array
    sd: Array
    common: Array
    length: Array
    noise: Array
    span: Array
    wander: Array
    alike: Array = field(default_factory=lambda: np.zeros(6))

    @property
    def used(self) -> NDArray[np.bool_]:
        """Means that can be used, (n, 6)."""
        return np.isfinite(self.y) & np.isfinite(self.sd)

    def without(self, left: NDArray[np.bool_]) -> Rows:
        """The rows, some of which (n,) are not to be used."""
        return replace(self, sd=np.where(left[:, None], np.nan, self.sd))


@dataclass(frozen=True)
class RowSource:
    """What rows are made of.

    Attributes
    ----------
    block : the samples, put right
    about : what was known
    usable : (n, 6) samples that may be used
    arrived : (p,) instant from which the device was at rest in each position, s
    warmth : the temperature
    pace : seconds of the device's clock in a true second
    left : (p, 6) variance that a swaying base leaves of each window's mean, SI squared
    white : (6,) deviation of one sample on such a base, where what is slow of the noise
        was taken out with what swayed
    unsure_gravity : m/s^2, standard deviation of what swaying takes from gravity

    """

    block: Block
    about: Description
    usable: NDArray[np.bool_]
    arrived: Array
    warmth: Thermometer
    pace: float = 1.0
    left: Array | None = None
    white: Array | None = None
    unsure_gravity: float = 0.0

    @property
    def whole(self) -> RowSource:
        """The same of the samples of which every output may be used, if there are any.

        The others are as if they had not been sent.
        """
        every = self.usable.all(axis=1)
        if every.all() or not every.any():
            return self
        kept = {f.name: getattr(self.block, f.name)[every] for f in fields(Block)}
        return replace(self, block=Block(**kept), usable=self.usable[every])

    @cached_property
    def rate(self) -> float:
        """Samples a second."""
        return rate_of(self.block)

    @cached_property
    def shaken(self) -> Shaking:
        """How noisy the windows are that have samples."""
        block = masked(self.block, self.usable)
        windows = spans(block, self.about)
        held = np.diff(windows, axis=1)[:, 0] > 1
        return shaking(block, windows[held], self.rate)


def reduce(
    source: RowSource,
    whole: bool = False,
    level: Array | None = None,
    apart: bool = False,
) -> Rows:
    """Cut the windows into blocks and average them.

    Parameters
    ----------
    source : what is cut
    whole : whether each window is one row, as a hand held the device
    level : (6,) standard deviation of one sample; if not given, what windows show
    apart : whether each window also has a row of its own for the gyroscopes, its last,
        and the blocks are those of the accelerometers

    """
    block, rate = masked(source.block, source.usable), source.rate
    windows = spans(block, source.about)
    held = np.flatnonzero(np.diff(windows, axis=1)[:, 0] > 1)
    shaken = source.shaken
    noise, levels = shaken.noise, shaken.levels
    if source.white is not None:
        noise, levels = np.fmax(noise, source.white), np.fmax(levels, source.white)
    if level is not None:
        noise, levels = level, np.tile(level, (len(held), 1))
    source = replace(source, block=shaken.block)
    without = source.about.without
    bounds = []
    for a, b in windows[held].tolist():
        each = np.zeros((0, 2), dtype=np.intp)
        if not whole:
            each = block_bounds(block.t, (a, b), rate, len(held), without)
        bounds.append(np.vstack([each, [(a, b)]]) if whole or apart else each)
    rows = [len(b) for b in bounds]
    out = averaged(
        source,
        np.concatenate(bounds),
        np.repeat(held, rows),
        np.repeat(levels, rows, axis=0),
        noise,
        np.repeat(shaken.variance, rows, axis=0),
    )
    rounded = rounding(block, windows[held])
    alike = rounding_alike(block, windows[held], rounded)
    off = np.repeat(rounded, rows, axis=0)
    if source.left is not None:
        off = np.hypot(off, np.sqrt(source.left[out.x.position]))
    # the Earth turns a device of unknown orientation about any of its axes; one that
    # was never turned has it in its bias, and some gyroscopes show where it points
    free = out.x.earth_unseen & (len(held) > 1)
    earth = EARTH_RATE / 3**0.5 * np.abs(source.about.nominal["gyr_scale"])
    off[free, 3:] = np.hypot(off[free, 3:], earth)
    if apart:
        ends = np.zeros(len(off), dtype=bool)
        ends[np.cumsum(rows) - 1] = True
        out.sd[ends, :3] = np.nan
        out.sd[~ends, 3:] = np.nan
    return replace(out, common=off, alike=alike)


def averaged(
    source: RowSource,
    bound: NDArray[np.intp],
    position: NDArray[np.intp],
    level: Array,
    noise: Array,
    variance: Array,
) -> Rows:
    """Average between bounds.

    Parameters
    ----------
    bound : (n, 2) first and one past the last sample of each row
    position : (n,) where the device was held
    level : (n, 6) standard deviation of one sample
    noise : (6,) the usual one
    variance : (n, 3) of the samples of the accelerometers, (m/s^2)^2

    """
    block = source.block
    y, count = block_means(masked(block, source.usable), bound)
    sd = level / np.sqrt(np.maximum(count, 1))
    told = (count > 0) & (sd > 0)  # what never changes tells nothing
    sd = np.where(told, sd, np.nan)
    span = np.column_stack([block.t[bound[:, 0]], block.t[bound[:, 1] - 1]])
    length = np.diff(bound, axis=1)[:, 0] / rate_of(block)
    x = _experience(source, position, y, span.mean(axis=1), length, variance)
    sd[~x.force_known, :3] = np.nan
    scale = source.about.nominal["gyr_scale"]
    _without_round(x, y[:, 3:], sd[:, 3:], length, scale)
    still = np.zeros((len(y), 3))
    return Rows(x, y, sd, np.zeros_like(sd), length, noise, span, still)


def _experience(
    source: RowSource,
    position: NDArray[np.intp],
    y: Array,
    t: Array,
    length: Array,
    variance: Array,
) -> Experience:
    """What the device goes through in rows of outputs (n, 6) at t, length s each."""
    about = source.about
    warming, heating = source.warmth.at(t)
    gyroscopes = readings(about, position, y[:, 3:])
    x = Experience.at_rest(
        *known_angles(about, position),
        about.gravity,
        f=force_read(about, position, y[:, :3]),
        t=t,
        lasts=length,
        since_start=t - source.block.t[0],
        since_turn=t - source.arrived[position],
        warming=warming,
        heating=heating,
        variance=np.nan_to_num(variance),
        position=position,
        rate=gyroscopes.rates(about.mounting),
        base_force=about.base_force,
        base_rate=about.base_rate,
        transport=about.under_way.rate,
        mounting=about.mounting,
        latitude=about.latitude,
        gravity_sigma=float(np.hypot(gravity_sigma(about), source.unsure_gravity)),
        joint_turns=_joint_turns(source),
        **known_attitudes(about, position),
    )
    free = ~x.oriented & ~x.rate.any(axis=1)
    return replace(x, w=np.where(free[:, None], gyroscopes.earth_rates(), x.w))


def _joint_turns(source: RowSource) -> JointTurns:
    """When the joints were turned, as far as the positions' angles are known.

    An attitude that was measured is not that of two joints: no joint stayed in its
    place because an angle did.
    """
    positions = source.about.positions
    if not positions:
        return JointTurns.none()
    known = np.column_stack([*angles(positions), third_angles(positions)])
    known[np.isfinite(attitude_sigmas(positions))] = np.nan
    return JointTurns.of(source.arrived[: len(known)], known)


def _without_round(
    x: Experience, gyr: Array, sd: Array, length: Array, scale: Array
) -> None:
    """Take out of the gyroscopes' means (n, 3) what goes round with a rate table."""
    for p in np.unique(x.position[x.rate.any(axis=1)]):
        at = np.flatnonzero(x.position == p)
        rate = x.rate[at[0]] @ x.mounting
        gyr[at] -= going_round(x.t[at], rate, gyr[at], sd[at], scale, length[at]).values
