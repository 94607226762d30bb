"""Aligns a recording with a reference of its motion: delay, clock rate, axes.

The delay is the shift at which the recording explains most of the reference. The shifts
of parts of the recording give the drift of one clock against the other. The rotation
between the axes brings the channels of the reference nearest to the triads (Wahba's
problem),

    R = argmax tr(R^T B),    B = sum of W x z^T over both triads                    (1)

with x the outputs, z the reference, and W the inverse variance of the part of the
outputs that the reference does not explain: of all three axes together, for which (1)
is exact, or of each axis where the reference lacks a channel. Source: F. Markley 1988.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from fieldcal.against.motion.coherence import common_hz
from fieldcal.against.motion.correlation import (
    explained_score,
    independent_samples,
    lag_scores,
)
from fieldcal.against.motion.grid import (
    GRID_HZ,
    TRIADS,
    EvenGrid,
    moving_triads,
    overlap,
)
from fieldcal.core.errors import InputError
from fieldcal.core.rotation import nearest_rotation
from fieldcal.core.samples import ACC, Array, Block, Index
from fieldcal.model.rows.motion import Alignment

DRIFT_PARTS, MAX_FURTHER_SHIFT_S = 5, 1.0
"""Parts of a recording that give the drift, and their largest further shift, s."""

MIN_DRIFT_PARTS = 3
"""Fewest parts from which the drift is estimated."""

RARE = 1e-6
"""Probability of the agreement of unrelated motions at some shift, for a match."""

MIN_SCORE_RATIO = 1.02
"""Least ratio of the best shift's score to that of any other shift."""

FAR_S = 2.0
"""Least distance of another shift, s."""

MIN_UNEXPLAINED_SHARE, MIN_UNEXPLAINED = 1e-6, 1e-12
"""Least unexplained variance of a channel: part of its variance; m^2/s^4, rad^2/s^2."""


@dataclass(frozen=True, slots=True)
class CommonMotion:
    """Alignment of two recordings of one motion.

    Attributes
    ----------
    alignment : delay, drift and rotation between them
    hz : (6,) frequency up to which the reference explains each output

    """

    alignment: Alignment
    hz: Array


def align_motion(real: Block, sim: Block, names: tuple[str, str]) -> CommonMotion:
    """Align a recording with a reference, to some hundredths of a second.

    Parameters
    ----------
    real, sim : samples of both, SI, each by its own clock
    names : what errors call them

    Raises
    ------
    InputError
        If they show no common motion, or one that repeats itself.

    """
    one, two = EvenGrid.of(real), EvenGrid.of(sim)
    if not moving_triads(one, two):
        raise InputError(
            f"{names[0]} and {names[1]} have no moving triad in common: compare"
            " accelerometers with accelerometers or gyroscopes with gyroscopes"
        )
    lag = _best_lag(one, two, names)
    middle = one.start + (len(one) - 1) / 2 / GRID_HZ
    delay, drift = _delay_and_drift(one, two, lag, middle)
    x, z = overlap(one, two, lag)
    rotation = _rotation(one, two, x, z)
    unseen = _unseen_gravity(one, two, rotation)
    hz = [common_hz(x[:, triad], z[:, triad], GRID_HZ) for triad in TRIADS]
    return CommonMotion(
        Alignment(delay, drift, middle, rotation, unseen), np.repeat(hz, 3)
    )


def _best_lag(one: EvenGrid, two: EvenGrid, names: tuple[str, str]) -> int:
    """The shift that explains most, in steps; refused if it is not significant."""
    lags, told = lag_scores(one, two)
    total = told.sum(axis=1)
    best = int(np.argmax(total))
    by_chance = chdtri(3 * told.shape[1], RARE / len(lags))
    if told[best] @ independent_samples(one, two) < by_chance:
        raise InputError(
            f"{names[0]} and {names[1]} show no common motion, or too even a one to"
            " tell: let the simulator follow the motion of this recording"
        )
    _check_only_one(lags, total, best, names)
    return int(lags[best])


def _check_only_one(
    lags: Index, total: Array, best: int, names: tuple[str, str]
) -> None:
    """Refuse a motion that agrees as well at another shift."""
    away = np.abs(lags - lags[best]) > FAR_S * GRID_HZ
    if total[best] > MIN_SCORE_RATIO * total[away].max(initial=0.0):
        return
    other = lags[away][int(np.argmax(total[away]))]
    raise InputError(
        f"{names[0]} and {names[1]} show a motion that repeats itself: shifted by"
        f" {lags[best] / GRID_HZ:.1f} s or by {other / GRID_HZ:.1f} s they agree alike;"
        " compare a recording with some motion that does not repeat"
    )


def _delay_and_drift(
    one: EvenGrid, two: EvenGrid, lag: int, middle: float
) -> tuple[float, float]:
    """Delay in the middle of the recording, s, and relative drift of its clock."""
    apart = one.start - two.start
    parts = [p for p in _lags_of_parts(one, two, lag) if p is not None]
    if len(parts) < MIN_DRIFT_PARTS:
        return lag / GRID_HZ + apart, 0.0
    at, off = np.array(parts).T
    slope, level = np.polyfit(at - middle, off, 1)
    return float(level) + apart, -float(slope)


def _lags_of_parts(
    one: EvenGrid, two: EvenGrid, lag: int
) -> list[tuple[float, float] | None]:
    """Middle and shift of each part of the recording, s."""
    edges = np.linspace(0, len(one), DRIFT_PARTS + 1).astype(int).tolist()
    return [
        _lag_of_part(one, two, lag, first, end)
        for first, end in zip(edges[:-1], edges[1:], strict=True)
    ]


def _lag_of_part(
    one: EvenGrid, two: EvenGrid, lag: int, first: int, end: int
) -> tuple[float, float] | None:
    """Middle and shift of one part, s; None if it has too little motion or overlap."""
    near = int(MAX_FURTHER_SHIFT_S * GRID_HZ)
    begin, stop = max(first - lag, near), min(end - lag, len(two) - near)
    x = one.six[begin + lag : stop + lag]
    if stop - begin < (end - first) / 2 or len(x) < stop - begin or not x.any():
        return None
    steps = range(-near, near + 1)
    told = [explained_score(x, two.six[begin - k : stop - k]) for k in steps]
    best = int(np.argmax(told))
    if not 0 < best < len(told) - 1:
        return None
    down, top, up = told[best - 1 : best + 2]
    bend = max(2 * top - down - up, 1e-12)
    shift = lag + steps[best] + (up - down) / 2 / bend
    middle = one.start + (begin + stop + 2 * lag) / 2 / GRID_HZ
    return middle, shift / GRID_HZ


def _rotation(one: EvenGrid, two: EvenGrid, x: Array, z: Array) -> Array:
    """Rotation between the axes of both, (1), from their overlap."""
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
        weight = 1 / np.maximum(
            own, MIN_UNEXPLAINED_SHARE * mine.var() + MIN_UNEXPLAINED
        )
        b += weight[:, None] * (mine.T @ theirs)
        if triad is ACC and moving.shape[1] == 3:  # where the force points
            mean = np.outer(one.mean[ACC], two.mean[ACC])
            b += len(x) * weight[:, None] * mean
    return nearest_rotation(b)  # (1)


def _unseen_gravity(one: EvenGrid, two: EvenGrid, rotation: Array) -> Array:
    """Gravity along the axis that stands upright, if the reference lacks it, (6,)."""
    out = np.zeros(6)
    force = rotation.T @ one.mean[ACC]
    upright = int(np.argmax(np.abs(force)))
    if not two.moving[upright]:
        out[upright] = force[upright]
    return out
