"""Somebody, or the wind, touched the device while it was held.

A stretch of a window, at_s and for_s long, far beyond what is usual in that window: in
single samples, in the mean of a tenth or half a second, or, for a gentle push, in the
amplitude of a half sine of up to two seconds. Usual is the noise, or what the window
shows at that length throughout, so that a base that rocks, a machine that shakes or a
hand that trembles makes no bumps. It is left out. Source: model of this project.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.physics.effect import Chain
from fieldcal.physics.gentle_pushes import GentlePush, block_length, gentle_pushes
from fieldcal.physics.pushes import (
    LOUD_MEAN_SIGMAS,
    LOUD_SAMPLE_SIGMAS,
    MIN_SAMPLES,
    SHAKEN_RATIO,
    UsualSpread,
    disturbed_stretches,
    running_means,
    usual_spread,
)
from fieldcal.physics.recording import CheckedSamples, Fault, medians
from fieldcal.physics.shape import Shape
from fieldcal.physics.steady_changes import AROUND_S, steady_changes
from fieldcal.physics.swings import swings

ROUNDED_HALF_STEPS = 4.02
"""Largest deviation that rounding explains, in half steps of an output."""

MAX_BUMP_S = 5.0
"""A disturbance that lasts longer is a change of the device, not a bump."""


USUAL_PUSH_S = 1.0
"""Length of a push of a hand or a gust, s."""

MAX_STEP_SIGMAS = 2.0
"""Step of an output, in standard deviations of noise, beyond which gentle pushes of it
are lost."""

NOTHING = slice(0, 0)

MIN_NAMED_SAMPLES = 3
"""Fewest samples of a bump; a single outlier is left out without being named."""


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
        some = [p for p, (first, last) in held if last - first >= MIN_SAMPLES]
        loud = {p: _disturbed_stretches(recording, p, rate) for p in some}
        gentle = _gently_pushed_stretches(recording, loud, rate)
        return [fault for p in some for fault in (*loud[p], *gentle[p])]


def _gently_pushed_stretches(
    recording: CheckedSamples, loud: Mapping[int, Sequence[Fault]], rate: float
) -> dict[int, list[Fault]]:
    """Gentle pushes in each window, beside the faults that it has already."""
    block = block_length(rate)
    windows = {p: _block_means(recording, p, loud[p], block) for p in loud}
    pushes = gentle_pushes(list(windows.values()), rate / block)
    out: dict[int, list[Fault]] = {p: [] for p in windows}
    around = round(AROUND_S * rate / block)
    for (p, z), found in zip(windows.items(), pushes, strict=True):
        for push in found:
            first = max(push.first - around, 0)
            near = z[first : push.last + around]
            at = (push.first - first, push.last - first)
            courses = _courses_without_push(near, at, rate / block)
            if all(push.is_in(near - course) for course in courses):
                out[p].append(_gentle_fault(recording, p, push, loud[p], block))
    return out


def _courses_without_push(
    near: Array, at: tuple[int, int], rate: float
) -> Iterator[Array]:
    """Courses that may look like a push from `at[0]` to `at[1]`, the quickest first."""
    yield from steady_changes(near, at, rate)
    yield from swings(near, at, rate)


def _block_means(
    recording: CheckedSamples, p: int, loud: Sequence[Fault], block: int
) -> Array:
    """Means of blocks of a window over their sigma by noise, (k, 6), without faults.

    nan where half of the samples are missing.
    """
    first, last = (int(i) for i in recording.windows[p])
    steps = recording.grids.within(first, last)
    size, noise = (last - first) // block, _noise(recording, steps)
    out = np.zeros((size, 6))
    bumped = np.zeros(last - first, dtype=bool)
    for fault in loud:
        bumped[fault.rows - first] = True
    for c in range(6):
        if steps[c] > MAX_STEP_SIGMAS * recording.noise[c]:
            continue  # what is less than a step is lost
        if c < 3 and recording.x.rate[p].any():
            continue  # the force goes round with the table
        z = recording.channel(c)[first:last] / noise[c]
        z[bumped] = np.nan
        parts = z[: size * block].reshape(size, block)
        count = np.isfinite(parts).sum(axis=1)
        mean = np.nansum(parts, axis=1) / np.maximum(count, 1) * np.sqrt(block)
        out[:, c] = np.where(2 * count > block, mean, np.nan)
    return out


def _disturbed_stretches(recording: CheckedSamples, p: int, rate: float) -> list[Fault]:
    """Disturbed stretches of one window."""
    out = []
    around, shortest = round(AROUND_S * rate), max(2, round(0.1 * rate))
    first, last = (int(i) for i in recording.windows[p])
    steps = recording.grids.within(first, last)
    noise = _noise(recording, steps)
    z = recording.six(first, last)
    z /= noise
    flat = z.copy(order="F")  # each channel in one piece
    _flatten(flat, rate)
    if (furthest := _most_disturbed_stretch(flat, rate, shortest)) != NOTHING:
        _flatten(z, rate, furthest)
    else:
        z = flat
    np.nan_to_num(z, copy=False)
    # what goes to the next step and back is rounded, not touched
    for c in np.flatnonzero(0.5 * steps >= noise):
        z[np.abs(z[:, c]) <= ROUNDED_HALF_STEPS, c] = 0.0
    if recording.x.rate[p].any():
        z[:, :3] = 0.0  # the force goes round with the table
    there = UsualSpread.of(z, shortest)
    for a, b in disturbed_stretches(z, shortest, there):
        if b - a > MAX_BUMP_S * rate:
            continue
        near = recording.six(first + max(a - around, 0), min(first + b + around, last))
        if not _has_steady_change(near / noise, there, (int(a), int(b)), rate):
            out.append(_fault(recording, first, int(a), int(b), z, rate))
    return out


def _noise(recording: CheckedSamples, steps: Array) -> Array:
    """Standard deviation of a sample, at least half a step, (6,)."""
    noise: Array = np.maximum(recording.noise, 0.5 * steps)
    noise[noise == 0.0] = np.inf  # what never changes is not pushed
    return noise


def _most_disturbed_stretch(z: Array, rate: float, m: int) -> slice:
    """Stretch of a second, or a quarter of a window, with the largest deviation.

    `z` is (n, c) in standard deviations, less its slow change. A push as long as that
    bends the course that is taken out with it, and is no part of what is usual. None
    where even the furthest is no further than noise goes.
    """
    width = max(min(4 * m, len(z) // 4), 1)
    mean = np.zeros(len(z) - width + 1)
    for column in z.T:
        (own,) = running_means(np.nan_to_num(column), [width])
        np.maximum(mean, own, out=mean)
    at, long = int(np.argmax(mean)), min(round(USUAL_PUSH_S * rate), len(z) // 4)
    first = at - (long - width) // 2
    # at the ends nothing on the other side tells the course
    inside = long <= first <= len(z) - 2 * long
    return (
        slice(first, first + long)
        if mean[at] > LOUD_MEAN_SIGMAS and inside
        else NOTHING
    )


def _flatten(piece: Array, rate: float, without: slice = NOTHING) -> None:
    """Subtract the slow change over seconds from a window, in place."""
    for column in piece.T:
        column[:] = _deviation_from_course(column, rate, without)


def _deviation_from_course(
    column: Array, rate: float, without: slice = NOTHING
) -> Array:
    """Samples (n,) less their slow change; `without` is not used to find it."""
    width = int(np.clip(round(2 * rate), 8, max(len(column) // 4, 8)))
    known = column.copy()
    known[without] = np.nan
    level, centre = _medians_by_part(known, max(len(column) // width, 1))
    some = np.isfinite(level)
    return (
        _deviation_from_parts(column, centre[some], level[some])
        if some.any()
        else column
    )


def _medians_by_part(column: Array, parts: int) -> tuple[Array, Array]:
    """Medians (parts,) of parts of a window, without nan, and centres of the parts.

    The parts are as long as each other, but for one sample; nan where nothing is known.

    >>> _medians_by_part(np.array([1.0, 5.0, 3.0, 7.0, np.nan]), 2)
    (array([3., 7.]), array([1. , 3.5]))
    """
    each, more = divmod(len(column), parts)
    middle = more * (each + 1)
    halves = (column[:middle], more), (column[middle:], parts - more)
    found = [medians(part.reshape(n, -1)) for part, n in halves if n]
    first = np.arange(parts) * each + np.minimum(np.arange(parts), more)
    centre = (first + np.append(first[1:], len(column)) - 1) / 2
    return np.concatenate(found), centre


def _has_steady_change(
    near: Array, there: UsualSpread, at: tuple[int, int], rate: float
) -> bool:
    """Whether a jump or an exponential change explains the samples near a stretch.

    `near` is (n, 6) in standard deviations, what lies around a stretch `at` of the
    window, first and one past the last sample; `there` what is usual in that.
    """
    near, around = np.nan_to_num(near), round(AROUND_S * rate)
    shortest, margin = max(2, round(0.1 * rate)), round(USUAL_PUSH_S * rate / 2)
    first = min(at[0], around)
    beside = slice(max(first - margin, 0), first + at[1] - at[0] + margin)
    for course in steady_changes(near, at, rate):
        rest = near - course
        _flatten(rest, rate)
        calm = (usual_spread(rest) < SHAKEN_RATIO * there.sample).all()
        usually = there.no_less_than(np.delete(rest, beside, axis=0), shortest)
        if calm and len(disturbed_stretches(rest, shortest, usually)) == 0:
            return True
    return False


def _deviation_from_parts(column: Array, centre: Array, level: Array) -> Array:
    """Samples (n,) less a polygon through the levels of the parts.

    Beyond the first and the last part it goes on as it was, or stays, whichever is
    nearer: what drifts goes on, and what sways turns back.
    """
    rows = np.arange(len(column))
    out: Array = column - np.interp(rows, centre, level)
    if len(centre) == 1:
        return out
    ends = (slice(0, int(centre[0]) + 1), 0), (slice(int(centre[-1]), len(column)), -2)
    for side, at in ends:
        slope = (level[at + 1] - level[at]) / (centre[at + 1] - centre[at])
        goes = column[side] - level[at] - slope * (rows[side] - centre[at])
        out[side] = np.where(np.abs(goes) < np.abs(out[side]), goes, out[side])
    return out


def _fault(
    recording: CheckedSamples, start: int, a: int, b: int, z: Array, rate: float
) -> Fault:
    t = recording.block.t
    worst = int(np.argmax(np.abs(z[a:b]).max(axis=0)))
    at, length = float(t[start + a]), float(t[start + b - 1] - t[start + a]) + 1 / rate
    margin = round(0.2 * rate)
    known = b - a >= MIN_NAMED_SAMPLES
    return Fault(
        channel=CHANNELS[worst],
        values={"at_s": at, "for_s": length} if known else {},
        sigmas={"at_s": 0.05 + 1 / rate, "for_s": 0.1 + 1 / rate},
        from_s=at,
        to_s=at + length,
        rows=start + np.arange(max(a - margin, 0), min(b + margin, len(z))),
        size=float(np.abs(z[a:b, worst]).max() * recording.noise[worst]),
        sigma=float(np.abs(z[a:b, worst]).max()),
        channels=tuple(
            np.array(CHANNELS)[np.abs(z[a:b]).max(axis=0) > LOUD_SAMPLE_SIGMAS]
        ),
    )


def _gentle_fault(
    recording: CheckedSamples,
    p: int,
    push: GentlePush,
    loud: Sequence[Fault],
    block: int,
) -> Fault:
    """Samples of a gentle push. Beside a loud one it is a part of that: not named."""
    start, end = (int(i) for i in recording.windows[p])
    t = recording.block.t
    first, last = start + push.first * block, min(start + push.last * block, end)
    at, to = float(t[first]), float(t[last - 1])
    length = to - at
    sigma = length / (2 * push.deviation)
    alone = all(at - f.to_s > length or f.from_s - to > length for f in loud)
    return Fault(
        channel=CHANNELS[push.channel],
        values={"at_s": at, "for_s": length} if alone else {},
        sigmas={"at_s": 0.05 + sigma, "for_s": 0.1 + sigma},
        from_s=at,
        to_s=to,
        rows=np.arange(first, last),
        size=abs(push.amplitude) * float(recording.noise[push.channel] / block**0.5),
        sigma=push.deviation,
    )
