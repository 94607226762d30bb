"""White noise of the samples, from what bends at short lags inside windows.

With means over m consecutive samples, the Hadamard variance times m,

    s^2(m) = m <(mean_{k+2} - 2 mean_{k+1} + mean_k)^2> / 6

is the variance of one sample for white noise, whatever m and however the mean drifts.
What is wanted is the level that a mean over a second obeys; shorter m are pooled in as
long as they agree with it, so that filtered or otherwise coloured outputs are not taken
for quieter ones. The mean of squares leaves out the largest tenth, so that a few
disturbed spots do not count.
Biases that walk by q sqrt(t) add a term in m^2, and where the levels rise like that,
white noise is what they rise from. Source: IEEE Std 952, annex C.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fieldcal.effects.quantisation import bias_of
from fieldcal.effects.recording import lsb_of
from fieldcal.samples import Array, Block

KEEP = 0.9
KEPT = 0.62302
"""Second moment of a unit normal inside its central nine tenths."""

MOST = 200_000
"""Differences that give a level to a third of a percent; more would only take time."""

GRAIN = 2000
"""Samples of a window in which the step of coarse outputs shows."""

AGREE = 3.0
ANCHOR_S = 1.0


def white(pieces: Sequence[Array], rate_hz: float) -> Array:
    """Standard deviation of one sample of each channel, (c,).

    Parameters
    ----------
    pieces : (n_i, c) samples of each window, nan where not to be used
    rate_hz : samples a second

    """
    channels = pieces[0].shape[1] if pieces else 0
    anchor = max(1, round(ANCHOR_S * rate_hz))
    longest = max((len(p) for p in pieces), default=0)
    anchor = max(1, min(anchor, longest // 8))
    lengths = [anchor]
    while lengths[-1] > 1:
        lengths.append(max(1, lengths[-1] // 4))
    levels, spreads = zip(*(_level(pieces, m) for m in lengths), strict=True)
    out = np.full(channels, np.nan)
    for c in range(channels):
        out[c] = _pooled(lengths, [v[c] for v in levels], [s[c] for s in spreads])
    # outputs coarser than their noise may not change at all while the device is held
    noise: Array = np.maximum(out, _grain(pieces) / np.sqrt(12))
    return noise


def noise_of(block: Block, windows: NDArray[np.intp], rate_hz: float) -> Array:
    """White noise of one sample of each output inside windows, (6,)."""
    held = [slice(a, b) for a, b in windows if b > a]
    return np.concatenate(
        [white([triad[w] for w in held], rate_hz) for triad in (block.acc, block.gyr)]
    )


def quick_of(block: Block, windows: NDArray[np.intp]) -> Array:
    """The same from one sample to the next alone, whatever is slower, (6,)."""
    held = [slice(a, b) for a, b in windows if b > a]
    out = []
    for triad in (block.acc, block.gyr):
        pieces = [triad[w] for w in held]
        level = _level(pieces, 1)[0] if pieces else np.full(3, np.nan)
        out.append(np.maximum(np.sqrt(level), _grain(pieces) / np.sqrt(12)))
    return np.concatenate(out)


def grain_of(block: Block, windows: NDArray[np.intp]) -> Array:
    """Deviation that rounding alone makes, from the least change, (6,)."""
    held = [slice(a, b) for a, b in windows if b > a]
    pieces = [[triad[w] for w in held] for triad in (block.acc, block.gyr)]
    out: Array = np.concatenate([_grain(p) for p in pieces]) / np.sqrt(12)
    return out


def _grain(pieces: Sequence[Array]) -> Array:
    """Smallest change of each channel from one sample to the next, (c,)."""
    steps = [np.abs(np.diff(p[:GRAIN], axis=0)) for p in pieces]
    some = np.concatenate(steps) if steps else np.zeros((0, 0))
    changes = np.where(some > 0, some, np.inf).min(axis=0, initial=np.inf)
    grain: Array = np.where(np.isfinite(changes), changes, 0.0)
    return grain


def rounding(block: Block, windows: NDArray[np.intp], noise: Array) -> Array:
    """How far off each mean in some windows may be because outputs were rounded, (6,).

    Source: Widrow and Kollar, see `fieldcal.effects.quantisation`; the deviation of a
    sine of that amplitude, as any place within a step is as likely.
    """
    off = np.zeros(len(noise))
    starts = [block[a : min(a + GRAIN, b)] for a, b in windows]
    some = np.concatenate([p.six for p in starts])
    for c, measured in enumerate(noise):
        step = lsb_of(some[:, c])
        if step > measured > 0:
            before = np.sqrt(max(measured**2 - step**2 / 12, 0.0))
            if any(np.ptp(p.six[:, c]) == 0 for p in starts if len(p) > 1):
                before = 0.0  # what stays on one step has next to no noise of its own
            off[c] = bias_of(step, before) / np.sqrt(2)
    return off


def _level(pieces: Sequence[Array], m: int) -> tuple[Array, Array]:
    """s^2(m) of each channel and its relative standard error."""
    most = max(MOST // len(pieces), 1)
    steps = [_steps(p, m, most) for p in pieces if len(p) >= 3 * m]
    if not steps:
        nothing = np.full(pieces[0].shape[1], np.nan)
        return nothing, nothing
    squares = m * np.concatenate(steps) ** 2 / 6
    count = np.isfinite(squares).sum(axis=0)
    level = np.full(squares.shape[1], np.nan)
    for c in np.flatnonzero(count >= 4):
        column = squares[np.isfinite(squares[:, c]), c]
        kept = int(np.ceil(KEEP * len(column)))
        level[c] = np.partition(column, kept - 1)[:kept].mean() / KEPT
    return level, np.sqrt(6.0 / np.maximum(count, 1))


def _steps(piece: Array, m: int, most: int) -> Array:
    """Bends over means of m samples in turn; of many, `most` evenly spread."""
    triples, channels = len(piece) // (3 * m), piece.shape[1]
    # a product is ten times as fast as a mean over few columns
    each = np.full(m, 1 / m)
    if triples > most:
        three = piece[: 3 * m * triples].reshape(triples, 3, m, channels)
        some: Array = np.diff(each @ three[:: triples // most], 2, axis=1)[:, 0]
        return some
    whole = len(piece) // m * m
    out: Array = np.diff(each @ piece[:whole].reshape(-1, m, channels), 2, axis=0)
    return out


def _pooled(
    lengths: Sequence[int], levels: Sequence[float], spreads: Sequence[float]
) -> float:
    """Level at the shortest m that all longer ones agree with."""
    under = _under_a_walk(lengths, levels, spreads)
    if under is not None:
        return under
    best, spread = levels[0], spreads[0]
    for level, finer in zip(levels[1:], spreads[1:], strict=True):
        if not np.isfinite(best):
            best, spread = level, finer
        elif not _agree(level, best, spread, finer):
            break
        else:
            best, spread = level, finer
    return float(np.sqrt(best))


def _under_a_walk(
    lengths: Sequence[int], levels: Sequence[float], spreads: Sequence[float]
) -> float | None:
    """White noise a of s^2(m) = a + b m^2, if that is what the levels obey."""
    if len(levels) < 3 or not np.isfinite(levels).all():
        return None
    square = np.square(lengths, dtype=float)
    slope = (levels[0] - levels[1]) / (square[0] - square[1])
    least = levels[1] - slope * square[1]
    if slope <= 0 or least <= 0 or _agree(levels[1], levels[0], *spreads[:2]):
        return None
    rest = zip(square[2:], levels[2:], spreads[2:], strict=True)
    if all(_agree(v, least + slope * m, spreads[1], s) for m, v, s in rest):
        return float(np.sqrt(least))
    return None


def _agree(one: float, other: float, spread: float, finer: float) -> bool:
    """Whether two levels are the same but for their relative errors."""
    error = np.hypot(spread, finer) * max(one, other)
    return bool(abs(one - other) <= AGREE * error)
