"""White noise of samples, from differences at short lags inside windows.

With means over m consecutive samples, the Hadamard variance times m,

    s^2(m) = m <(mean_{k+2} - 2 mean_{k+1} + mean_k)^2> / 6                      (1)

is the variance of one sample for white noise, for any m and any linear drift. The white
noise is the level at m of one second. Levels at shorter m, which are more precise,
replace it as long as they agree with it; thus filtered or otherwise coloured outputs do
not appear quieter. The largest tenth of the squares is left out of their mean, and with
it short disturbances. Biases
with a random walk of q sqrt(t) add a term in m^2; if the levels rise like that, the
white noise is the level without this term. At m = 1 the level is that of the fastest
noise. To compare the noise of windows, long vibration must be included; for that
purpose the short-lag noise is

    s^2 = <(x_{k+1} - x_k)^2> / 2                                                (2)

A rotation to and fro, such as hand tremor, has an s^2(m) that rises above that at m = 1
and falls again, finally as 1/m, since its angle stays bounded. Noise of a sensor does
not fall. The noise of the sensor is then that of fourth differences, which contain
almost nothing of motion slower than a tenth of the sample rate,

    s^2 = <(x_{k+2} - 4 x_{k+1} + 6 x_k - 4 x_{k-1} + x_{k-2})^2> / 70            (3)

No level is below what the steps of the outputs allow (`rounding`), nor, for what is
calculated from it, below what converters leave (`converter_noise`). Source: IEEE Std
952, annex C; J. von Neumann 1941 for (2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.windows import rounding
from fieldcal.windows.sums import smallest_changes

KEEP = 0.9
CENTRAL_SECOND_MOMENT = 0.62302
"""Part of the squares that is kept, and second moment of the central nine tenths of a
unit normal."""

MOST_DIFFERENCES = 200_000
"""Most differences that are used: they give a level to a third of a percent."""

STEP_SAMPLES = 2000
"""Samples of a window from which the step of coarse outputs is taken."""

RISES, FALLS = 2.0, 2.0
"""Least ratios of the maximum of s^2(m) to its first and its last value for a motion to
and fro."""

EFFECTIVE_BITS = 23.5
"""Full scale in units of the noise, as a power of 2, of a converter of 24 bits made for
slow signals, at 10 to 80 samples a second (TI, SBAS350G, ADS1232 and ADS1234)."""

AGREE = 3.0
ANCHOR_S = 1.0
"""Standard errors within which levels agree, and the longest means, s."""


@dataclass(frozen=True, slots=True)
class ChannelNoise:
    """Standard deviation of one sample of each channel, (c,); nan where unknown.

    Attributes
    ----------
    white : white noise, from means over a second and shorter ones that agree
    quick : noise from one sample to the next, (1) at m = 1

    """

    white: Array
    quick: Array


def measure_noise(pieces: Sequence[Array], rate_hz: float) -> ChannelNoise:
    """Measure the noise of a sensor.

    Parameters
    ----------
    pieces : (n_i, c) samples of each window, one at least, nan where not to be used
    rate_hz : samples a second

    """
    anchor = max(1, round(ANCHOR_S * rate_hz))
    anchor = max(1, min(anchor, max(map(len, pieces)) // 8))
    lengths = [anchor]
    while lengths[-1] > 1:
        lengths.append(max(1, lengths[-1] // 4))
    measured = [_level(pieces, m) for m in lengths]
    levels, spreads = (np.array(column).T for column in zip(*measured, strict=True))
    white = [_agreed_level(lengths, v, s) for v, s in zip(levels, spreads, strict=True)]
    # outputs coarser than their noise may not change at all while the device is held
    least = rounding.least_deviation(smallest_steps(pieces))
    quick = np.maximum(np.sqrt(levels[:, -1]), least)
    return ChannelNoise(np.maximum(white, least), quick)


def converter_noise(block: Block) -> Array:
    """Least standard deviation of one sample, (6,), that a converter leaves.

    A triad's full scale, which is twice its largest values at least, over 2 to the
    power of `EFFECTIVE_BITS`; 0 where nothing was measured. Samples have less if they
    are computed: by a simulation, or as means of others.

    Parameters
    ----------
    block : samples of a recording, turns included

    """
    some = block[:: max(1, len(block) // MOST_DIFFERENCES)]
    values = (np.abs(triad[np.isfinite(triad)]) for triad in (some.acc, some.gyr))
    # not the very largest, which may be wrong bits
    most = [np.quantile(own, 0.99) if len(own) else 0.0 for own in values]
    return np.repeat(2 * np.array(most) / 2**EFFECTIVE_BITS, 3)


def is_to_and_fro(pieces: Sequence[Array]) -> bool:
    """Whether a triad shows a motion to and fro beyond its fastest noise.

    Parameters
    ----------
    pieces : (n_i, 3) samples of each window, nan where not to be used

    """
    longest = max((len(p) for p in pieces), default=0) // 4
    lengths = [1 << k for k in range(longest.bit_length())]
    sums = [_level(pieces, m)[0].sum() for m in lengths]
    levels = np.array([v for v in sums if np.isfinite(v)])
    if len(levels) < 3:
        return False
    top = levels.max()
    return bool(top > RISES * levels[0] and top > FALLS * levels[-1])


def quickest_noise(pieces: Sequence[Array]) -> Array:
    """Deviation of one sample (c,) without any slower motion, (3).

    Parameters
    ----------
    pieces : (n_i, c) samples of each window, nan where not to be used

    """
    most = max(MOST_DIFFERENCES // max(len(pieces), 1), 1)
    steps = [np.diff(p[:most], 4, axis=0) for p in pieces]
    square: Array = np.nanmean(np.concatenate(steps) ** 2, axis=0) / 70  # (3)
    return np.sqrt(square)


def short_lag_noise(values: Array) -> Array:
    """Deviation of one sample (c,) from the next, of samples (n, c), (2)."""
    steps = np.diff(values, axis=0)
    count = np.full(values.shape[1], len(steps))
    known = np.isfinite(steps)
    if not known.all():
        count = known.sum(axis=0)
        steps[~known] = 0.0
    total = np.einsum("nc,nc->c", steps, steps)
    return np.sqrt(np.where(count > 0, total / np.maximum(2 * count, 1), np.nan))


def smallest_steps(pieces: Sequence[Array]) -> Array:
    """Smallest change of each channel from one sample to the next, (c,); 0 if none."""
    changes = [_least_change(p[:STEP_SAMPLES]) for p in pieces if len(p) > 1]
    none = np.full(pieces[0].shape[1], np.inf)
    least: Array = np.min(changes, axis=0) if changes else none
    return np.where(np.isfinite(least), least, 0.0)


def _least_change(values: Array) -> Array:
    steps = np.nan_to_num(np.diff(values, axis=0))
    change: Array = smallest_changes(steps.T, np.zeros(1, dtype=np.int64))[0]
    return change


def _level(pieces: Sequence[Array], m: int) -> tuple[Array, Array]:
    """s^2(m) of each channel and its relative standard error, (1)."""
    most = max(MOST_DIFFERENCES // len(pieces), 1)
    steps = [_second_differences(p, m, most) for p in pieces if len(p) >= 3 * m]
    if not steps:
        nothing = np.full(pieces[0].shape[1], np.nan)
        return nothing, nothing
    squares = m * np.concatenate(steps) ** 2 / 6
    count = np.isfinite(squares).sum(axis=0)
    level = np.full(squares.shape[1], np.nan)
    for c in np.flatnonzero(count >= 4):
        column = squares[np.isfinite(squares[:, c]), c]
        kept = int(np.ceil(KEEP * len(column)))
        level[c] = np.partition(column, kept - 1)[:kept].mean() / CENTRAL_SECOND_MOMENT
    return level, np.sqrt(6.0 / np.maximum(count, 1))


def _second_differences(piece: Array, m: int, most: int) -> Array:
    """Second differences of means over m samples; of many, about `most` of them."""
    triples, channels = len(piece) // (3 * m), piece.shape[1]
    if triples > most:
        every = piece[: 3 * m * triples].reshape(triples, 3 * m, channels)
        selected = every[:: triples // most]
        means = _means(selected.reshape(-1, m, channels)).reshape(-1, 3, channels)
        out: Array = np.diff(means, 2, axis=1)[:, 0]
        return out
    whole = len(piece) // m * m
    return np.diff(_means(piece[:whole].reshape(-1, m, channels)), 2, axis=0)


def _means(rows: Array) -> Array:
    """Means (n, c) of m samples each, (n, m, c)."""
    # each channel by itself: it lies in one piece, and its nan are its own
    weights = np.full(rows.shape[1], 1 / rows.shape[1])
    return np.asarray((rows.transpose(2, 0, 1) @ weights).T)


def _agreed_level(lengths: Sequence[int], levels: Array, spreads: Array) -> float:
    """Level at the shortest m that all longer ones agree with."""
    under = _white_under_walk(lengths, levels, spreads)
    if under is not None:
        return under
    best, spread = levels[0], spreads[0]
    for level, finer in zip(levels[1:], spreads[1:], strict=True):
        if not np.isfinite(best):
            best, spread = level, finer
        elif not _levels_agree(level, best, spread, finer):
            break
        else:
            best, spread = level, finer
    return float(np.sqrt(best))


def _white_under_walk(
    lengths: Sequence[int], levels: Array, spreads: Array
) -> float | None:
    """White noise a of s^2(m) = a + b m^2, if that is what the levels obey."""
    if len(levels) < 3 or not np.isfinite(levels).all():
        return None
    square = np.square(lengths, dtype=float)
    slope = (levels[0] - levels[1]) / (square[0] - square[1])
    least = levels[1] - slope * square[1]
    if slope <= 0 or least <= 0 or _levels_agree(levels[1], levels[0], *spreads[:2]):
        return None
    rest = zip(square[2:], levels[2:], spreads[2:], strict=True)
    if all(_levels_agree(v, least + slope * m, spreads[1], s) for m, v, s in rest):
        return float(np.sqrt(least))
    return None


def _levels_agree(
    level: float, other_level: float, spread: float, finer: float
) -> bool:
    """Whether two levels agree within their relative errors."""
    error = np.hypot(spread, finer) * max(level, other_level)
    return bool(abs(level - other_level) <= AGREE * error)
