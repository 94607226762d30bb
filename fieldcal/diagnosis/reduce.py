"""Samples to block means: the rows that every hypothesis is fitted to.

Each window is cut into blocks of about a second, longer ones later in the window when
there are many seconds: what happens after a turn happens at the start. So a hypothesis
costs milliseconds however long the recording is. The standard deviation of a mean of n
white samples of deviation s is s / sqrt(n); s is measured in the recording (`noise`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.description import Description
from fieldcal.diagnosis.noise import rounding, white
from fieldcal.diagnosis.thermometer import Thermometer
from fieldcal.effects import Experience
from fieldcal.frames import EARTH_RATE, earth_rate_home, force_home
from fieldcal.positions import angles
from fieldcal.samples import Array, Block

ROWS = 360
"""Rows aimed at, over all windows."""

FEWEST, MOST = 8, 120
"""Rows of one window."""

FIRST_S = 1.0

LOUDER = 6.0
"""Significance from which a window counts as noisier than the others."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Block means and what the device goes through in each.

    Attributes
    ----------
    x : n rows
    y : (n, 6) means, m/s^2 and rad/s; nan where nothing was usable
    sd : (n, 6) standard deviation of each mean from white noise
    length : (n,) s
    noise : (6,) standard deviation of one sample

    """

    x: Experience
    y: Array
    sd: Array
    length: Array
    noise: Array

    @property
    def used(self) -> NDArray[np.bool_]:
        """Means that can be used, (n, 6)."""
        return np.isfinite(self.y) & np.isfinite(self.sd)


def rate_of(block: Block) -> float:
    """Samples a second, from the times."""
    return float(1 / np.median(np.diff(block.t))) if len(block) > 1 else 1.0


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
class Source:
    """What rows are made of.

    Attributes
    ----------
    block : the samples, put right
    about : what was known
    usable : (n, 6) samples that may be used
    arrived : (p,) instant from which the device was at rest in each position, s
    warmth : the temperature
    pace : seconds of the device's clock in a true second

    """

    block: Block
    about: Description
    usable: NDArray[np.bool_]
    arrived: Array
    warmth: Thermometer
    pace: float = 1.0


def reduce(source: Source) -> Rows:
    """Cut the windows into blocks and average them."""
    block, rate = source.block, rate_of(source.block)
    windows = spans(block, source.about)
    held = np.flatnonzero(np.diff(windows, axis=1)[:, 0] > 1)
    six = np.where(source.usable, block.six, np.nan)
    pieces = [six[a:b] for a, b in windows[held]]
    noise, levels = levels_of(pieces, rate)
    bounds = [_cut(block.t, a, b, rate, len(held)) for a, b in windows[held]]
    rows = [len(b) for b in bounds]
    level = np.repeat(levels, rows, axis=0)
    out = averaged(source, np.concatenate(bounds), np.repeat(held, rows), level, noise)
    off = np.tile(rounding(pieces, noise), (len(out.x), 1))
    # the Earth turns a device of unknown orientation about any of its axes
    free = ~out.x.oriented
    earth = EARTH_RATE / 3**0.5 * np.abs(source.about.nominal["gyr_scale"])
    off[free, 3:] = np.hypot(off[free, 3:], earth)
    same = np.sqrt(np.repeat(rows, rows))[:, None] * off  # all through a window
    return replace(out, sd=np.hypot(out.sd, same))


def averaged(
    source: Source,
    bound: NDArray[np.intp],
    position: NDArray[np.intp],
    level: Array,
    noise: Array,
) -> Rows:
    """Average between bounds.

    Parameters
    ----------
    bound : (n, 2) first and one past the last sample of each row
    position : (n,) where the device was held
    level : (n, 6) standard deviation of one sample
    noise : (6,) the usual one

    """
    block, about = source.block, source.about
    y, count = _means(np.where(source.usable, block.six, np.nan), bound)
    sd = np.where(count > 0, level / np.sqrt(np.maximum(count, 1)), np.nan)
    t = (block.t[bound[:, 0]] + block.t[bound[:, 1] - 1]) / 2
    warming, heating = source.warmth.at(t)
    x = Experience.at_rest(
        *_angles(about, position),
        about.gravity,
        f=_free_force(about, position, y),
        t=t,
        since_start=t - block.t[0],
        since_turn=t - source.arrived[position],
        warming=warming,
        heating=heating,
        variance=np.nan_to_num(level[:, :3] ** 2),
        position=position,
        rate=table_rate(about, position),
        base_force=force_home(about.gravity),
        base_rate=earth_rate_home(about.latitude) * (about.grade == "navigation"),
        mounting=about.mounting,
        latitude=about.latitude,
    )
    sd[~_force_known(x), :3] = np.nan
    return Rows(x, y, sd, np.diff(bound, axis=1)[:, 0] / rate_of(block), noise)


def _cut(t: Array, first: int, last: int, rate: float, windows: int) -> Array:
    grid = edges(float(t[first]), float(t[last - 1]) + 0.5 / rate, windows)
    at = first + np.searchsorted(t[first:last], grid)
    keep = np.diff(at) > 0
    return np.column_stack([at[:-1][keep], at[1:][keep]])


def _means(six: Array, bound: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp]]:
    """Means between bounds, (n, 6), and how many samples are in each."""
    some = np.isfinite(six)
    first = np.argmax(some, axis=0)
    centre = np.nan_to_num(six[first, np.arange(six.shape[1])])
    shifted = np.nan_to_num(six - centre)
    flat = bound.ravel()
    if flat[-1] == len(six):  # reduceat takes starts only; the end needs no start
        flat = flat[:-1]
    total = np.add.reduceat(shifted, flat, axis=0)[::2]
    count = np.add.reduceat(some.astype(np.intp), flat, axis=0)[::2]
    mean = total / np.maximum(count, 1) + centre
    return np.where(count > 0, mean, np.nan), count


def levels_of(pieces: Sequence[Array], rate: float) -> tuple[Array, Array]:
    """Deviation of one sample: usual (6,), and in each window (w, 6).

    The usual one is that of the quiet windows. Others have more, and vibration comes on
    top of the noise, whatever the noise's colour.
    """
    out = np.full((len(pieces), pieces[0].shape[1]), np.nan)
    for i, piece in enumerate(pieces):
        steps = np.diff(piece, axis=0) ** 2 / 2
        count = np.isfinite(steps).sum(axis=0)
        some = np.where(count > 0, np.nansum(steps, axis=0), np.nan)
        out[i] = np.sqrt(some / np.maximum(count, 1))
    low = np.sort(out, axis=0)[(len(out) - 1) // 4]  # nan comes last
    samples = np.array([[max(len(p), 2)] for p in pieces])
    margin = LOUDER / np.sqrt(samples)
    louder = out > low * np.exp(margin)
    quiet = ~louder.any(axis=1)
    few = [p for p, q in zip(pieces, quiet, strict=True) if q] or list(pieces)
    noise = white(few, rate)
    more = np.where(louder, out**2 - low**2, 0.0)
    return noise, np.sqrt(noise**2 + np.maximum(more, 0.0))


def _angles(about: Description, position: NDArray[np.intp]) -> tuple[Array, Array]:
    if not about.positions:
        unknown = np.full(len(position), np.nan)
        return unknown, unknown
    alpha, beta = angles(about.positions)
    return alpha[position], beta[position]


def table_rate(about: Description, position: NDArray[np.intp]) -> Array:
    """Rate that a table adds in some positions, (n, 3) rad/s about procedure axes."""
    if not about.positions:
        return np.zeros((len(position), 3))
    rates = np.array([p.rate or (0.0, 0.0, 0.0) for p in about.positions])
    out: Array = rates[position]
    return out


def _free_force(about: Description, position: NDArray[np.intp], y: Array) -> Array:
    """Force of length g along what the accelerometers read in each position."""
    out = np.zeros((len(position), 3))
    apart = (y[:, :3] - about.nominal["acc_bias"]) / about.nominal["acc_scale"]
    for p in np.unique(position):
        mean = np.nanmean(np.nan_to_num(apart[position == p]), axis=0)
        out[position == p] = about.gravity * mean / max(np.linalg.norm(mean), 1e-12)
    return out


def _force_known(x: Experience) -> NDArray[np.bool_]:
    """Rows in which the turning of a rate table does not turn the force as well."""
    speed = np.linalg.norm(x.rate, axis=1)
    along = np.linalg.norm(np.cross(x.rate @ x.mounting, x.f), axis=1)
    steady = along <= 1e-3 * speed * x.gravity
    known: NDArray[np.bool_] = (speed == 0) | (x.oriented & steady)
    return known
