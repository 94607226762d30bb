"""Samples to block means: the rows that every hypothesis is fitted to.

Each window is cut into blocks of about a second, longer ones later in the window when
there are many seconds: what happens after a turn happens at the start. So a hypothesis
costs milliseconds however long the recording is. The standard deviation of a mean of n
white samples of deviation s is s / sqrt(n); s is measured in the recording (`noise`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.positions import (
    Position,
    angles,
    attitude_sigmas,
    speeds,
    third_angles,
)
from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.noise import rounding
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.rows.turntable import Readings, going_round
from fieldcal.model.rows.vibration import shaking
from fieldcal.physics.experience import Experience
from fieldcal.session.description import Description
from fieldcal.session.site_gravity import gravity_sigma

ROWS = 360
"""Rows aimed at, over all windows."""

FEWEST, MOST = 8, 120
"""Rows of one window."""

FIRST_S = 1.0

STEPS = 100_000
"""Steps between samples that tell the rate; more would only take time."""

SPAN = 50
"""Samples over which stamps that come in bursts are even."""


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
    wander : rms of what a hand adds to the force across it within windows, m/s^2

    """

    x: Experience
    y: Array
    sd: Array
    common: Array
    length: Array
    noise: Array
    span: Array
    wander: float = 0.0

    @property
    def used(self) -> NDArray[np.bool_]:
        """Means that can be used, (n, 6)."""
        return np.isfinite(self.y) & np.isfinite(self.sd)

    def without(self, left: NDArray[np.bool_]) -> Rows:
        """The rows, some of which (n,) are not to be used."""
        return replace(self, sd=np.where(left[:, None], np.nan, self.sd))


def rate_of(block: Block) -> float:
    """Samples a second, from the times."""
    if len(block) < 2:
        return 1.0
    first = np.arange(0, len(block) - 1, max(len(block) // STEPS, 1))
    step = float(np.median(block.t[first + 1] - block.t[first]))
    over = block.t[SPAN::SPAN] - block.t[:-SPAN:SPAN]  # stamps may come in bursts
    return 1 / max(step, float(np.median(over)) / SPAN if len(over) else 0.0)


def spans(block: Block, about: Description) -> NDArray[np.intp]:
    """First and one past the last sample of each position's window, (p, 2).

    A session without positions is one window, the whole of it. A position without a
    window, or with one that no sample lies in, gets an empty span.
    """
    if not about.positions:
        return np.array([[0, len(block)]])
    ends = [w if w is not None else (np.inf, np.inf) for w in about.windows]
    return np.searchsorted(block.t, np.array(ends)).astype(np.intp)


def edges(start: float, end: float, windows: int) -> Array:
    """Edges of the blocks of a window, s: a second each, later ones longer if need be.

    >>> edges(0.0, 5.0, 9).tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    """
    length = end - start
    count = int(np.clip(ROWS // max(windows, 1), FEWEST, MOST))
    if length <= count * FIRST_S:
        return np.linspace(start, end, max(1, round(length / FIRST_S)) + 1)
    low, high = 1.0, 10.0
    for _ in range(60):
        ratio = (low + high) / 2
        longer = FIRST_S * np.sum(ratio ** np.arange(count)) > length
        low, high = (low, ratio) if longer else (ratio, high)
    lengths = FIRST_S * low ** np.arange(count)
    out = start + np.concatenate([[0.0], np.cumsum(lengths)])
    out[-1] = end
    return out


@dataclass(frozen=True, slots=True)
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

    """

    block: Block
    about: Description
    usable: NDArray[np.bool_]
    arrived: Array
    warmth: Thermometer
    pace: float = 1.0
    left: Array | None = None
    white: Array | None = None


def masked(block: Block, usable: NDArray[np.bool_]) -> Block:
    """Samples with nan for those that may not be used; the block itself if all may."""
    if usable.all():
        return block
    new = {}
    for name, may in (("acc", usable[:, :3]), ("gyr", usable[:, 3:])):
        triad = getattr(block, name)
        if (np.isfinite(triad) & ~may).any():
            new[name] = np.where(may, triad, np.nan)
    return replace(block, **new) if new else block


def reduce(source: RowSource) -> Rows:
    """Cut the windows into blocks and average them."""
    block, rate = masked(source.block, source.usable), rate_of(source.block)
    windows = spans(block, source.about)
    held = np.flatnonzero(np.diff(windows, axis=1)[:, 0] > 1)
    shaken = shaking(block, windows[held], rate)
    noise, levels = shaken.noise, shaken.levels
    if source.white is not None:
        noise, levels = np.fmax(noise, source.white), np.fmax(levels, source.white)
    source = replace(source, block=shaken.block)
    bounds = [_cut(block.t, a, b, rate, len(held)) for a, b in windows[held]]
    rows = [len(b) for b in bounds]
    out = averaged(
        source,
        np.concatenate(bounds),
        np.repeat(held, rows),
        np.repeat(levels, rows, axis=0),
        noise,
        np.repeat(shaken.variance, rows, axis=0),
    )
    off = np.repeat(rounding(block, windows[held]), rows, axis=0)
    if source.left is not None:
        off = np.hypot(off, np.sqrt(source.left[out.x.position]))
    # the Earth turns a device of unknown orientation about any of its axes; one that
    # was never turned has it in its bias, and some gyroscopes show where it points
    free = ~out.x.oriented & (len(held) > 1) & ~out.x.earth_seen
    earth = EARTH_RATE / 3**0.5 * np.abs(source.about.nominal["gyr_scale"])
    off[free, 3:] = np.hypot(off[free, 3:], earth)
    return replace(out, common=off)


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
    block, about = source.block, source.about
    y, count = _means(masked(block, source.usable), bound)
    sd = level / np.sqrt(np.maximum(count, 1))
    sd = np.where(
        (count > 0) & (sd > 0), sd, np.nan
    )  # what never changes tells nothing
    span = np.column_stack([block.t[bound[:, 0]], block.t[bound[:, 1] - 1]])
    t = span.sum(axis=1) / 2
    warming, heating = source.warmth.at(t)
    x = Experience.at_rest(
        *_angles(about, position),
        about.gravity,
        f=_force_of(about, position, y),
        t=t,
        lasts=np.diff(bound, axis=1)[:, 0] / rate_of(block),
        since_start=t - block.t[0],
        since_turn=t - source.arrived[position],
        warming=warming,
        heating=heating,
        variance=np.nan_to_num(variance),
        position=position,
        rate=readings(about, position, y[:, 3:]).rates(about.mounting),
        base_force=about.base_force,
        base_rate=about.base_rate,
        transport=about.under_way.rate,
        mounting=about.mounting,
        latitude=about.latitude,
        gravity_sigma=gravity_sigma(about),
        **_attitudes(about, position),
    )
    free = ~x.oriented & ~x.rate.any(axis=1)
    seen = readings(about, position, y[:, 3:]).earth_rates()
    x = replace(x, w=np.where(free[:, None], seen, x.w))
    sd[~x.force_known, :3] = np.nan
    length = np.diff(bound, axis=1)[:, 0] / rate_of(block)
    _without_round(x, y[:, 3:], sd[:, 3:], length, about.nominal["gyr_scale"])
    return Rows(x, y, sd, np.zeros_like(sd), length, noise, span)


def _without_round(
    x: Experience, gyr: Array, sd: Array, length: Array, scale: Array
) -> None:
    """Take out of the gyroscopes' means (n, 3) what goes round with a rate table."""
    for p in np.unique(x.position[x.rate.any(axis=1)]):
        at = np.flatnonzero(x.position == p)
        rate = x.rate[at[0]] @ x.mounting
        gyr[at] -= going_round(x.t[at], rate, gyr[at], sd[at], scale, length[at]).values


def _cut(t: Array, first: int, last: int, rate: float, windows: int) -> Array:
    grid = edges(float(t[first]), float(t[last - 1]) + 0.5 / rate, windows)
    at = first + np.searchsorted(t[first:last], grid)
    keep = np.diff(at) > 0
    return np.column_stack([at[:-1][keep], at[1:][keep]])


def _means(block: Block, bound: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp]]:
    """Means between bounds, (n, 6), and how many samples are in each, (n, 6)."""
    parts = [_triad_means(triad, bound) for triad in (block.acc, block.gyr)]
    mean, count = (np.hstack(both) for both in zip(*parts, strict=True))
    return mean, count


def _triad_means(
    triad: Array, bound: NDArray[np.intp]
) -> tuple[Array, NDArray[np.intp]]:
    centre = np.nan_to_num(_middle(triad[bound[0, 0] : bound[0, 1]]))
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


def _middle(values: Array) -> Array:
    """Median of each column over what is known, nan where nothing is."""
    out = np.full(values.shape[1], np.nan)
    for c, column in enumerate(values.T):
        known = column[np.isfinite(column)]
        out[c] = np.median(known) if len(known) else np.nan
    return out


def _angles(about: Description, position: NDArray[np.intp]) -> tuple[Array, Array]:
    if not about.positions:
        unknown = np.full(len(position), np.nan)
        return unknown, unknown
    alpha, beta = angles(about.positions)
    return alpha[position], beta[position]


def _attitudes(about: Description, position: NDArray[np.intp]) -> dict[str, Array]:
    """The third turn of each row, how well its position is known, and its speed."""
    if not about.positions:
        return {}
    positions = about.positions
    return {
        "gamma": third_angles(positions)[position],
        "attitude_sigma": attitude_sigmas(positions)[position],
        "speed": speeds(positions)[0][position],
        "speed_sigma": speeds(positions)[1][position],
    }


def readings(about: Description, position: NDArray[np.intp], gyr: Array) -> Readings:
    """What gyroscopes read in each row, by their outputs (n, 3), nan where unknown."""
    w = (gyr - about.nominal["gyr_bias"]) / about.nominal["gyr_scale"]
    positions = about.positions or (Position("all of it"),) * (int(position.max()) + 1)
    return Readings(positions, position, w, float(np.linalg.norm(about.base_rate)))


def _force_of(about: Description, position: NDArray[np.intp], y: Array) -> Array:
    """Force along what the accelerometers read in each position."""
    apart = (y[:, :3] - about.nominal["acc_bias"]) / about.nominal["acc_scale"]
    return free_force(about.gravity, position, apart)


def free_force(gravity: float, position: NDArray[np.intp], f: Array) -> Array:
    """Force of length g along what is read in each position, (n, 3)."""
    out = np.zeros((len(position), 3))
    for p in np.unique(position):
        mean = np.nanmean(np.nan_to_num(f[position == p]), axis=0)
        out[position == p] = gravity * mean / max(np.linalg.norm(mean), 1e-12)
    return out
