"""Where a recording stands beside a reference: delay, clock rate, axes.

The shift at which the recording explains most of the reference is the delay; those of
parts of the recording tell the drift of one clock against the other; and the turn
between the axes is the one that brings the channels of the reference nearest to the
triads (Wahba's problem),

    R = argmax tr(R^T B),    B = sum of W x z^T over both triads                    (1)

with x the outputs, z the reference, and W one over the variance of what the reference
does not make of the outputs: of all three together, for which (1) is exact, but of each
where the reference lacks a channel that they feel. Source: F. Markley 1988.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from fieldcal.against.motion.coherence import common_hz
from fieldcal.against.motion.correlation import independent, score, scores
from fieldcal.against.motion.grid import GRID_HZ, TRIADS, Grid, overlap, shared
from fieldcal.core.errors import InputError
from fieldcal.core.samples import ACC, Array, Block, Index
from fieldcal.model.rows.motion import Alignment

PARTS, NEAR_S = 5, 1.0
"""Parts of a recording that tell the drift, and how far they are sought, s."""

FEWEST = 3
"""Parts from which they tell it."""

RARE = 1e-6
"""Probability that motions which have nothing in common agree as well at some shift."""

ALIKE = 1.02
"""By how much one shift must explain more than any other to be the one."""

FAR_S = 2.0
"""From where on a shift is another one, s."""

EXACT, TINY = 1e-6, 1e-12
"""Part of its variance, and m^2/s^4 or rad^2/s^2, that a channel is off by at least."""


@dataclass(frozen=True, slots=True)
class CommonMotion:
    """What two recordings have in common.

    Attributes
    ----------
    alignment : where they stand beside each other
    hz : (6,) frequency up to which the reference says what each output goes through

    """

    alignment: Alignment
    hz: Array


def aligned(real: Block, sim: Block, names: tuple[str, str]) -> CommonMotion:
    """Find where a recording stands beside a reference, to some hundredths of a second.

    Parameters
    ----------
    real, sim : samples of both, SI, each by its own clock
    names : what errors call them

    Raises
    ------
    InputError
        If they show no common motion, or one that repeats itself.

    """
    one, two = Grid.of(real), Grid.of(sim)
    if not shared(one, two):
        raise InputError(
            f"{names[0]} and {names[1]} have no moving triad in common: compare"
            " accelerometers with accelerometers or gyroscopes with gyroscopes"
        )
    lag = _lag(one, two, names)
    middle = one.start + (len(one) - 1) / 2 / GRID_HZ
    delay, drift = _clock(one, two, lag, middle)
    x, z = overlap(one, two, lag)
    rotation = _rotation(one, two, x, z)
    unseen = _unseen(one, two, rotation)
    hz = [common_hz(x[:, triad], z[:, triad], GRID_HZ) for triad in TRIADS]
    return CommonMotion(
        Alignment(delay, drift, middle, rotation, unseen), np.repeat(hz, 3)
    )


def _lag(one: Grid, two: Grid, names: tuple[str, str]) -> int:
    """The shift that explains most, in steps, if it is clearly the one."""
    lags, told = scores(one, two)
    total = told.sum(axis=1)
    best = int(np.argmax(total))
    by_chance = chdtri(3 * told.shape[1], RARE / len(lags))
    if told[best] @ independent(one, two) < by_chance:
        raise InputError(
            f"{names[0]} and {names[1]} show no common motion, or too even a one to"
            " tell: let the simulator follow the motion of this recording"
        )
    _check_only_one(lags, total, best, names)
    return int(lags[best])


def _check_only_one(
    lags: Index, total: Array, best: int, names: tuple[str, str]
) -> None:
    """Refuse a motion that agrees alike at another shift."""
    away = np.abs(lags - lags[best]) > FAR_S * GRID_HZ
    if total[best] > ALIKE * total[away].max(initial=0.0):
        return
    other = lags[away][int(np.argmax(total[away]))]
    raise InputError(
        f"{names[0]} and {names[1]} show a motion that repeats itself: shifted by"
        f" {lags[best] / GRID_HZ:.1f} s or by {other / GRID_HZ:.1f} s they agree alike;"
        " compare a recording with some motion that does not repeat"
    )


def _clock(one: Grid, two: Grid, lag: int, middle: float) -> tuple[float, float]:
    """Delay in the middle of the recording, s, and drift of its clock, 1."""
    apart = one.start - two.start
    parts = [p for p in _parts(one, two, lag) if p is not None]
    if len(parts) < FEWEST:
        return lag / GRID_HZ + apart, 0.0
    at, off = np.array(parts).T
    slope, level = np.polyfit(at - middle, off, 1)
    return float(level) + apart, -float(slope)


def _parts(one: Grid, two: Grid, lag: int) -> list[tuple[float, float] | None]:
    """Middles of parts of the recording, s, and what the shift is in each, s."""
    edges = np.linspace(0, len(one), PARTS + 1).astype(int).tolist()
    return [
        _part(one, two, lag, first, end)
        for first, end in zip(edges[:-1], edges[1:], strict=True)
    ]


def _part(
    one: Grid, two: Grid, lag: int, first: int, end: int
) -> tuple[float, float] | None:
    """The same of one part, if most of it moves and its best shift lies within."""
    near = int(NEAR_S * GRID_HZ)
    begin, stop = max(first - lag, near), min(end - lag, len(two) - near)
    x = one.six[begin + lag : stop + lag]
    if stop - begin < (end - first) / 2 or len(x) < stop - begin or not x.any():
        return None
    steps = range(-near, near + 1)
    told = [score(x, two.six[begin - k : stop - k]) for k in steps]
    best = int(np.argmax(told))
    if not 0 < best < len(told) - 1:
        return None
    down, top, up = told[best - 1 : best + 2]
    bend = max(2 * top - down - up, 1e-12)
    shift = lag + steps[best] + (up - down) / 2 / bend
    middle = one.start + (begin + stop + 2 * lag) / 2 / GRID_HZ
    return middle, shift / GRID_HZ


def _rotation(one: Grid, two: Grid, x: Array, z: Array) -> Array:
    """The turn between the axes of both, (1), of what overlaps of them."""
    b = np.zeros((3, 3))
    for triad in TRIADS:
        mine, theirs = x[:, triad], z[:, triad]
        moving = theirs[:, theirs.any(axis=0)]
        if not moving.size or not mine.any():
            continue
        made = moving @ np.linalg.lstsq(moving, mine, rcond=None)[0]
        own = (mine - made).var(axis=0)
        if moving.shape[1] == 3:
            own = np.full(3, own.mean())
        weight = 1 / np.maximum(own, EXACT * mine.var() + TINY)
        b += weight[:, None] * (mine.T @ theirs)
        if triad is ACC and moving.shape[1] == 3:  # where the force points
            mean = np.outer(one.mean[ACC], two.mean[ACC])
            b += len(x) * weight[:, None] * mean
    left, _, right = np.linalg.svd(b)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    out: Array = left @ sign @ right  # (1)
    return out


def _unseen(one: Grid, two: Grid, rotation: Array) -> Array:
    """Gravity along the axis that stands upright, if the reference lacks it, (6,)."""
    out = np.zeros(6)
    force = rotation.T @ one.mean[ACC]
    upright = int(np.argmax(np.abs(force)))
    if not two.moving[upright]:
        out[upright] = force[upright]
    return out
