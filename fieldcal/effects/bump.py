"""Somebody, or the wind, touched the device while it was held.

A stretch of a window, at_s and for_s long, far beyond what is usual in that window: in
single samples, or in the mean of a tenth or half a second. Usual is the noise, or what
the window shows at that length throughout, so that a base that rocks, a machine that
shakes or a hand that trembles makes no bumps. It is left out. Source: model of this
project.

>>> import numpy as np
>>> quiet = np.random.default_rng(1).standard_normal((1000, 1))
>>> quiet[400:420] += 7.0
>>> [(int(a), int(b)) for a, b in disturbed(quiet, 10)]
[(400, 420)]
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.chances import DEVIATION
from fieldcal.core.samples import CHANNELS, Array, runs
from fieldcal.physics.effect import Chain
from fieldcal.physics.recording import CheckedSamples, Fault, medians
from fieldcal.physics.shape import Shape

LARGEST = 6.5
"""A single sample, in standard deviations."""

LARGE = 4.0
"""A sample that belongs to a stretch found by its mean."""

MEAN = 6.0
"""The mean of a short stretch, in standard deviations."""

NEXT = 4.02
"""Two steps of an output, in half steps: to the next one, off a course between two."""

SHAKEN, TAILS = 1.5, 1.6
"""Spread beyond the noise that a machine or a hand makes, and how far its tails go at
least: what a nonlinear sensor makes of it goes further to one side."""

OUTER = (0.9, 0.95)
"""Shares of the values that tell how a tail goes on, beyond what a bump takes up."""

SELDOM = 1e-4
"""Windows in which what shakes them throughout goes further than is told from them."""

MANY = 50_000
"""Values that tell the usual spread to half a percent."""

LONGEST_S = 5.0
"""A disturbance that lasts longer is a change of the device, not a bump."""

AROUND_S = 3.0
"""Before and after a disturbance, where a jump of the level shows."""

FADES_S = (1.0, 1.5, 2.0, 3.0, 4.5)
"""Time constants of what fades after a turn; slower ones are no disturbance anyway."""

FEWEST = 20
"""Samples of a window that tell what is usual in it."""

SHORTEST = 3
"""Samples; a single wild one is left out and not called a bump."""


def disturbed(z: Array, m: int) -> NDArray[np.intp]:
    """Stretches far beyond unit noise, (k, 2) first and one past the last sample.

    `z` is (n, c) in standard deviations, without its slow part; `m` the samples of the
    shortest stretch looked at as a whole.
    """
    scale = usual(z)
    scale *= np.where(scale > SHAKEN, np.maximum(_tails(z, scale), TAILS), 1.0)
    # channel by channel: an hour of samples need not be in memory once more
    size = np.zeros(len(z))
    for column, one in zip(z.T, scale, strict=True):
        np.maximum(size, np.abs(column) / one, out=size)
    loud = size > LARGEST
    alone = _alone(size)
    for width in (m, 4 * m):
        if width < 2 or width >= len(z):
            continue
        peak = np.zeros(len(z) - width + 1)
        for column, one in zip(z.T, scale, strict=True):
            # a byte decoded wrongly is no push: without it, what of the mean is left
            level = np.where(alone, 0.0, column / one)
            np.maximum(peak, _means(level, width), out=peak)
        for first, last in runs(peak > MEAN):
            at = first + int(np.argmax(peak[first:last]))
            loud[at : at + width] = True
    found = _joined(runs(loud), 2 * m)
    return np.array([_trimmed(size, a, b) for a, b in found])


def _alone(size: Array) -> NDArray[np.bool_]:
    """Single samples beyond noise between usual ones, by their deviations (n,).

    >>> _alone(np.array([0.1, 90.0, 0.3, 0.2, 8.0, 9.0, 0.4])).nonzero()
    (array([1]),)
    """
    calm = np.concatenate([[True], size <= LARGE, [True]])
    alone: NDArray[np.bool_] = (size > LARGEST) & calm[:-2] & calm[2:]
    return alone


def _means(column: Array, width: int) -> Array:
    """Means over stretches of that width, in those that are usual, (n - width + 1,)."""
    total = np.concatenate([[0.0], np.cumsum(column)])
    mean: Array = np.abs(total[width:] - total[:-width]) / np.sqrt(width)
    mean /= usual(mean[:, None])
    return mean


def usual(z: Array) -> Array:
    """Spread of each column by its middle half, at least that of the noise, (c,).

    >>> usual(np.array([[0.0], [3.0], [-3.0], [3.0], [-3.0], [90.0]])).round(2)
    array([4.45])
    """
    some = np.abs(z[:: max(len(z) // MANY, 1)].T, order="C")
    spread: Array = DEVIATION * np.median(some, axis=1)
    return np.maximum(spread, 1.0)


def _tails(z: Array, spread: Array) -> Array:
    """How much further each column may go than a normal law of that spread, (c,).

    The tail is an exponential one, as of the square that a nonlinear sensor adds to a
    vibration; that of a normal law is shorter. It is that of the third of the window in
    which it is shortest: a bump is not in all of them.

    >>> z = np.random.default_rng(1).standard_normal((10_000, 2))
    >>> z[:, 1] = z[:, 1] ** 2 - 1.0
    >>> z[2000:5000, 0] += 50.0
    >>> _tails(z, np.array([1.0, 1.1])).round(1)
    array([1.6, 3.6])
    """
    some = np.abs(z[:: max(len(z) // MANY, 1)].T, order="C")
    parts = np.array_split(some, 3, axis=1)
    told = [np.quantile(part, OUTER, axis=1) for part in parts]
    inner, outer = np.stack(told, axis=1)
    share = (1 - OUTER[0]) / (1 - OUTER[1])
    length = (outer - inner) / np.log(share)
    far = inner + length * np.log((1 - OUTER[0]) * len(z) / SELDOM)
    shortest: Array = far.min(axis=0) / (LARGEST * spread)
    return shortest


def _joined(stretches: NDArray[np.intp], gap: int) -> NDArray[np.intp]:
    """Stretches with the short breaks between them closed."""
    out: list[list[int]] = []
    for first, last in stretches:
        if out and first - out[-1][1] <= gap:
            out[-1][1] = int(last)
        else:
            out.append([int(first), int(last)])
    return np.array(out, dtype=np.intp).reshape(-1, 2)


def _trimmed(size: Array, first: int, last: int) -> tuple[int, int]:
    """A stretch from its first large sample to its last; `size` (n,) in deviations."""
    large = np.flatnonzero(size[first:last] > LARGE)
    if len(large) < 2:
        return first, last
    return first + int(large[0]), first + int(large[-1]) + 1


class Bump(Chain):
    """A short disturbance inside a window."""

    shapes = (Shape("at_s", "s"), Shape("for_s", "s"))
    covariate = "a stretch far beyond the noise"
    treatment = "mask"
    place = 2
    decided_by = "the window taken again"
    cure = "Take the window again; nothing else is lost."
    source = "model of this project"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """Disturbed stretches of every window."""
        rate = 1 / float(np.median(np.diff(recording.block.t)))
        held = enumerate(recording.windows)
        some = [p for p, (first, last) in held if last - first >= FEWEST]
        return [fault for p in some for fault in _touched(recording, p, rate)]


def _touched(recording: CheckedSamples, p: int, rate: float) -> list[Fault]:
    """Disturbed stretches of one window."""
    out = []
    first, last = (int(i) for i in recording.windows[p])
    steps = 0.5 * recording.steps
    noise = np.maximum(recording.noise, steps)
    z = recording.six(first, last)
    _flatten(z, rate)
    z /= noise
    np.nan_to_num(z, copy=False)
    # what goes to the next step and back is rounded, not touched
    for c in np.flatnonzero(steps >= noise):
        z[np.abs(z[:, c]) <= NEXT, c] = 0.0
    if recording.x.rate[p].any():
        z[:, :3] = 0.0  # the force goes round with the table
    around = round(AROUND_S * rate)
    for a, b in disturbed(z, max(2, round(0.1 * rate))):
        if b - a > LONGEST_S * rate:
            continue
        near = recording.six(first + max(a - around, 0), min(first + b + around, last))
        if not _steady(near / noise, usual(z), int(a), rate):
            out.append(_fault(recording, first, int(a), int(b), z, rate))
    return out


def _flatten(piece: Array, rate: float) -> None:
    """Take its course over seconds out of a window, in place."""
    width = int(np.clip(round(2 * rate), 8, max(len(piece) // 4, 8)))
    count = max(len(piece) // width, 1)
    level, centre = _levels(piece, count)
    for c, column in enumerate(piece.T):
        known = np.isfinite(level[:, c])
        if known.any():
            column -= _course(len(piece), centre[known], level[known, c])


def _levels(piece: Array, parts: int) -> tuple[Array, Array]:
    """Medians (parts, c) of what is known in parts of a window, and their middles.

    The parts are as long as each other, but for one sample; nan where nothing is known.

    >>> _levels(np.array([[1.0], [5.0], [3.0], [7.0], [np.nan]]), 2)
    (array([[3.],
           [7.]]), array([1. , 3.5]))
    """
    each, more = divmod(len(piece), parts)
    middle = more * (each + 1)
    halves = [part for part in (piece[:middle], piece[middle:]) if len(part)]
    counts = [n for n in (more, parts - more) if n]
    level = np.empty((parts, piece.shape[1]))
    for c in range(piece.shape[1]):
        level[:, c] = np.concatenate(
            [
                medians(half[:, c].reshape(n, -1))
                for half, n in zip(halves, counts, strict=True)
            ]
        )
    first = np.arange(parts) * each + np.minimum(np.arange(parts), more)
    return level, (first + np.append(first[1:], len(piece)) - 1) / 2


def _steady(near: Array, spread: Array, start: int, rate: float) -> bool:
    """Whether the level only jumps there, or fades from the window's start.

    `near` is (n, 6) in standard deviations, what lies around a stretch that begins
    with a sample of the window, `spread` (6,) what is usual in that.
    """
    near, around = np.nan_to_num(near), round(AROUND_S * rate)
    courses = [_jump(near, around // 2)]
    if start < around:
        courses += [_fading(near, tau * rate) for tau in FADES_S]
    rest = [near - c for c in courses if c is not None]
    shortest = max(2, round(0.1 * rate))
    return any(
        (usual(r) < SHAKEN * spread).all() and len(disturbed(r, shortest)) == 0
        for r in rest
    )


def _jump(z: Array, margin: int) -> Array | None:
    """Level that jumps where means before and after part most, (n, 6).

    None if that leaves fewer than `margin` samples on one side.
    """
    n, each = len(z), np.arange(1, len(z))[:, None]
    total = np.cumsum(z, axis=0)
    before = total[:-1] / each
    after = (total[-1] - total[:-1]) / (n - each)
    gain = ((after - before) ** 2 * each * (n - each)).sum(axis=1)
    at = int(np.argmax(gain))
    if min(at + 1, n - at - 1) < margin:
        return None
    level: Array = np.where(np.arange(n)[:, None] <= at, before[at], after[at])
    return level


def _fading(z: Array, tau: float) -> Array:
    """What fades with a time constant, in samples, towards a level, (n, 6)."""
    design = np.column_stack([np.ones(len(z)), np.exp(-np.arange(len(z)) / tau)])
    course: Array = design @ np.linalg.lstsq(design, z, rcond=None)[0]
    return course


def _course(n: int, centre: Array, level: Array) -> Array:
    """Straight from part to part, and on beyond the first and the last, (n,)."""
    rows = np.arange(n)
    course: Array = np.interp(rows, centre, level)
    if len(centre) > 1:
        ends = (slice(0, int(centre[0]) + 1), 0), (slice(int(centre[-1]), n), -2)
        for side, at in ends:
            slope = (level[at + 1] - level[at]) / (centre[at + 1] - centre[at])
            course[side] = level[at] + slope * (rows[side] - centre[at])
    return course


def _fault(
    recording: CheckedSamples, start: int, a: int, b: int, z: Array, rate: float
) -> Fault:
    t = recording.block.t
    worst = int(np.argmax(np.abs(z[a:b]).max(axis=0)))
    at, length = float(t[start + a]), float(t[start + b - 1] - t[start + a]) + 1 / rate
    margin = round(0.2 * rate)
    known = b - a >= SHORTEST
    return Fault(
        channel=CHANNELS[worst],
        values={"at_s": at, "for_s": length} if known else {},
        sigmas={"at_s": 0.05 + 1 / rate, "for_s": 0.1 + 1 / rate},
        from_s=at,
        to_s=at + length,
        rows=start + np.arange(max(a - margin, 0), min(b + margin, len(z))),
        size=float(np.abs(z[a:b, worst]).max() * recording.noise[worst]),
        sigma=float(np.abs(z[a:b, worst]).max()),
        channels=tuple(np.array(CHANNELS)[np.abs(z[a:b]).max(axis=0) > LARGEST]),
    )
