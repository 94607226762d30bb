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

from fieldcal.effects import Chain, Fault, Recording, Shape
from fieldcal.effects.recording import runs
from fieldcal.samples import CHANNELS, Array

LARGEST = 6.5
"""A single sample, in standard deviations."""

LARGE = 4.0
"""A sample that belongs to a stretch found by its mean."""

MEAN = 6.0
"""The mean of a short stretch, in standard deviations."""

NEXT = 4.02
"""Two steps of an output, in half steps: to the next one, off a course between two."""

SHAKEN, TAILS = 1.5, 1.6
"""Spread beyond the noise that a machine or a hand makes, and how far its tails go."""

MANY = 50_000
"""Values that tell the usual spread to half a percent."""

LONGEST_S = 5.0
"""A disturbance that lasts longer is a change of the device, not a bump."""

AROUND_S = 3.0
"""Before and after a disturbance, where a jump of the level shows."""

FADES_S = (1.0, 1.5, 2.0, 3.0, 4.5)
"""Time constants of what fades after a turn; slower ones are no disturbance anyway."""

SHORTEST = 3
"""Samples; a single wild one is left out and not called a bump."""


def disturbed(z: Array, m: int) -> NDArray[np.intp]:
    """Stretches far beyond unit noise, (k, 2) first and one past the last sample.

    `z` is (n, c) in standard deviations, without its slow part; `m` the samples of the
    shortest stretch looked at as a whole.
    """
    spread = usual(z)
    z = z / (spread * np.where(spread > SHAKEN, TAILS, 1.0))
    loud: NDArray[np.bool_] = np.any(np.abs(z) > LARGEST, axis=1)
    total = np.zeros((z.shape[1], len(z) + 1)).T
    np.cumsum(z, axis=0, out=total[1:])
    for width in (m, 4 * m):
        if width < 2 or width >= len(z):
            continue
        mean = np.abs(total[width:] - total[:-width]) / np.sqrt(width)
        level = usual(mean)
        for first, last in runs((mean > MEAN * level).any(axis=1)):
            at = first + int(np.argmax((mean[first:last] / level).max(axis=1)))
            loud[at : at + width] = True
    return np.array([_trimmed(z, a, b) for a, b in _joined(runs(loud), 2 * m)])


def usual(z: Array) -> Array:
    """Spread of each column by its middle half, at least that of the noise, (c,).

    >>> usual(np.array([[0.0], [3.0], [-3.0], [3.0], [-3.0], [90.0]])).round(2)
    array([4.45])
    """
    some = np.abs(z[:: max(len(z) // MANY, 1)].T, order="C")
    spread: Array = 1.4826 * np.median(some, axis=1)
    return np.maximum(spread, 1.0)


def _joined(stretches: NDArray[np.intp], gap: int) -> NDArray[np.intp]:
    """Stretches with the short breaks between them closed."""
    out: list[list[int]] = []
    for first, last in stretches:
        if out and first - out[-1][1] <= gap:
            out[-1][1] = int(last)
        else:
            out.append([int(first), int(last)])
    return np.array(out, dtype=np.intp).reshape(-1, 2)


def _trimmed(z: Array, first: int, last: int) -> tuple[int, int]:
    """A stretch from its first large sample to its last."""
    large = np.flatnonzero((np.abs(z[first:last]) > LARGE).any(axis=1))
    if len(large) < 2:
        return first, last
    return first + int(large[0]), first + int(large[-1]) + 1


class Bump(Chain):
    """A short disturbance inside a window."""

    shapes = (Shape("at_s", "s"), Shape("for_s", "s"))
    covariate = "a stretch far beyond the noise"
    decided_by = "the window taken again"
    source = "model of this project"

    def find(self, recording: Recording) -> list[Fault]:
        """Disturbed stretches of every window."""
        t, out = recording.block.t, []
        rate = 1 / float(np.median(np.diff(t)))
        steps = 0.5 * recording.steps
        noise = np.maximum(recording.noise, steps)
        for p, (first, last) in enumerate(recording.windows):
            if last - first < 20:
                continue
            piece = recording.six(first, last)
            z = np.nan_to_num(_quick(piece, rate) / noise, copy=False)
            # what goes to the next step and back is rounded, not touched
            for c in np.flatnonzero(steps >= noise):
                z[np.abs(z[:, c]) <= NEXT, c] = 0.0
            if recording.x.rate[p].any():
                z[:, :3] = 0.0  # the force goes round with the table
            shortest = max(2, round(0.1 * rate))
            for a, b in disturbed(z, shortest):
                if b - a > LONGEST_S * rate:
                    continue
                if _steady(piece / noise, usual(z), (int(a), int(b)), rate):
                    continue
                out.append(_fault(recording, t, int(first), int(a), int(b), z, rate))
        return out


def _quick(piece: Array, rate: float) -> Array:
    """What is left of a window when its course over seconds is taken out."""
    width = int(np.clip(round(2 * rate), 8, max(len(piece) // 4, 8)))
    count = max(len(piece) // width, 1)
    level, centre = medians(piece, count)
    out = np.zeros_like(piece)
    for c, column in enumerate(piece.T):
        known = np.isfinite(level[:, c])
        if known.any():
            course = _course(len(piece), centre[known], level[known, c])
            out[:, c] = column - course
    return out


def medians(piece: Array, parts: int) -> tuple[Array, Array]:
    """Medians (parts, c) of what is known in parts of a window, and their middles.

    The parts are as long as each other, but for one sample; nan where nothing is known.

    >>> medians(np.array([[1.0], [5.0], [3.0], [7.0], [np.nan]]), 2)
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
                _middle(half[:, c].reshape(n, -1))
                for half, n in zip(halves, counts, strict=True)
            ]
        )
    first = np.arange(parts) * each + np.minimum(np.arange(parts), more)
    return level, (first + np.append(first[1:], len(piece)) - 1) / 2


def _middle(values: Array) -> Array:
    """Median of what is known in each row, (n,)."""
    if not np.isfinite(values.sum()):
        some = [row[np.isfinite(row)] for row in values]
        return np.array([np.median(row) if len(row) else np.nan for row in some])
    half, odd = divmod(values.shape[1], 2)
    ordered = np.partition(values, half, axis=1)
    upper: Array = ordered[:, half]
    return upper if odd else (ordered[:, :half].max(axis=1) + upper) / 2


def _steady(z: Array, spread: Array, stretch: tuple[int, int], rate: float) -> bool:
    """Whether the level only jumps there, or fades from the window's start.

    `z` is (n, 6) in standard deviations, `spread` (6,) what is usual in the window.
    """
    a, b = stretch
    around = round(AROUND_S * rate)
    near = np.nan_to_num(z[max(a - around, 0) : b + around])
    courses = [_jump(near, around // 2)]
    if a < around:
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
    recording: Recording, t: Array, start: int, a: int, b: int, z: Array, rate: float
) -> Fault:
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
        rows=np.arange(max(start, start + a - margin), start + b + margin),
        size=float(np.abs(z[a:b, worst]).max() * recording.noise[worst]),
        sigma=float(np.abs(z[a:b, worst]).max()),
        channels=tuple(np.array(CHANNELS)[np.abs(z[a:b]).max(axis=0) > LARGEST]),
    )
