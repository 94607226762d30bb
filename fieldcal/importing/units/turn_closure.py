"""The scale of rates by which turns lead from one rest to the next.

    u_B = u_A carried along du/dt = u x w / s                                      (1)

A hand that turns a device in jerks adds its own forces on the way, but not at the ends:
gravity at rest before a turn and behind it says what the turn was. The scale s at which
the turns close is looked for about one that is roughly known.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fieldcal.core.rotation import cross_matrix
from fieldcal.core.samples import Array

GROUP_S, REST_S, TURN_S = 0.1, 0.5, 20.0
"""Parts of a rest, the shortest rest and the longest turn, s."""

MARGIN_S = 1.0
"""At both ends of a rest, which may be parts of turns, at most a quarter of it, s."""

NEAR_G = 0.1
"""Part by which |a| at rest is not g."""

CALM_LIMITS = 0.2, 2.0
"""Calmest part of the groups, and how many times its spread a rest has at most."""

STEADY_RAD = np.deg2rad(2.0)
"""Turn of gravity from one half of a rest to the other."""

MIN_TURN_RAD = np.deg2rad(30.0)
"""Turn of gravity from rest to rest that counts, rad."""

FEWEST_TURNS = 3

CLOSES, OPENS = np.deg2rad(8.0), 3.0
"""What turns that close miss by, rad, and how much more others do."""

ABOUT, TRIED = 1.7, 61
"""Factor about the rough scale that is tried, in so many steps."""

STEP_S = 0.02
"""Time over which a rate is taken as one, s."""


class TurnBetweenRests(NamedTuple):
    """A turn between two rests.

    Attributes
    ----------
    before, behind : (3,) direction of the force at rest
    angles : (m, 3) rates times their durations, numbers of the file times s

    """

    before: Array
    behind: Array
    angles: Array


def closing_scale(t: Array, up: Array, gyr: Array, rough: float) -> float | None:
    """Scale of rates at which the turns close, by (1); None where they do at none.

    Parameters
    ----------
    t : (n,) s
    up : (n, 3) force over gravity, device axes
    gyr : (n, 3) numbers of the file, nan where it is not known what the rate was
    rough : about what 1 rad/s reads

    """
    turns = list(_turns(t, up, gyr))
    if len(turns) < FEWEST_TURNS:
        return None
    scales = rough * np.geomspace(1 / ABOUT, ABOUT, TRIED)
    missed = np.array([_closure_errors(one, scales) for one in turns])
    # one of the turns may have gone on beyond what a rest was taken for
    usual = np.median(missed, axis=0)
    best = int(usual.argmin())
    inside = 0 < best < TRIED - 1
    if not inside or usual[best] > CLOSES or usual.max() < OPENS * usual[best]:
        return None
    return float(scales[best])


def _turns(t: Array, up: Array, gyr: Array) -> Iterator[TurnBetweenRests]:
    step = float(np.median(np.diff(t)))
    if step <= 0:
        # most rows share the time of the row before: nothing says how long a rest is
        return
    inner = (
        _inner_part(*rest, step)
        for rest in _rests(up, max(4, round(GROUP_S / step)), step)
    )
    rests = [(a, b) for a, b in inner if _lies_still(up[a:b])]
    at_rest = np.vstack([np.empty((0, 3)), *(gyr[a:b] for a, b in rests)])
    at_rest = at_rest[np.isfinite(at_rest).all(axis=1)]
    if not len(at_rest):
        return
    zero = at_rest.mean(axis=0)  # a hand trembles: what one short rest reads is no bias
    for (a, b), (c, d) in zip(rests, rests[1:], strict=False):
        before, behind = (_direction(up[i:j]) for i, j in ((a, b), (c, d)))
        turned = np.arccos(np.clip(before @ behind, -1, 1))
        steps = np.diff(t[b - 1 : c + 1])
        if turned < MIN_TURN_RAD or t[c] - t[b] > TURN_S or (steps > GROUP_S).any():
            continue
        angles = (gyr[b : c + 1] - zero) * steps[:, None]
        if not np.isfinite(angles).all():
            continue
        many = max(1, round(STEP_S / step))
        starts = np.arange(0, len(angles), many)
        yield TurnBetweenRests(before, behind, np.add.reduceat(angles, starts, axis=0))


def _rests(up: Array, group: int, step: float) -> list[tuple[int, int]]:
    """First and one past the last row of each rest."""
    groups = up[: len(up) // group * group].reshape(-1, group, 3)
    spread = groups.std(axis=1).max(axis=1)
    length = np.linalg.norm(groups.mean(axis=1), axis=1)
    share, times = CALM_LIMITS
    calm = spread <= times * np.quantile(spread, share)
    calm &= np.abs(length - 1) < NEAR_G
    edges = np.flatnonzero(np.diff(np.concatenate([[0], calm.astype(int), [0]])))
    pairs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    least = REST_S / (group * step)
    return [(group * a, group * b) for a, b in pairs if b - a >= least]


def _inner_part(first: int, last: int, step: float) -> tuple[int, int]:
    """Inner part of a rest, without the slow start and end of turns.

    What is cut off belongs to the turn, for it may have turned already.
    """
    margin = min((last - first) // 4, round(MARGIN_S / step))
    return first + margin, last - margin


def _lies_still(up: Array) -> bool:
    """Whether gravity does not turn: a slow turn is as calm as a hand that trembles."""
    half = len(up) // 2
    begun, ended = _direction(up[:half]), _direction(up[half:])
    return bool(np.linalg.norm(ended - begun) < STEADY_RAD)


def _direction(up: Array) -> Array:
    mean = up.mean(axis=0)
    unit: Array = mean / np.linalg.norm(mean)
    return unit


def _closure_errors(turn: TurnBetweenRests, scales: Array) -> Array:
    """Closure of a turn at each of the scales (k,), rad."""
    u = np.tile(turn.before, (len(scales), 1))
    size = np.linalg.norm(turn.angles, axis=1)
    angles, size = turn.angles[size > 0], size[size > 0]
    axes, by = angles / size[:, None], size[:, None, None] / scales[:, None]
    steps = zip(axes, cross_matrix(axes), np.cos(by), np.sin(by), strict=True)
    for axis, cross, cos, sin in steps:
        along = (u @ axis)[:, None] * axis
        # (1): the force turns against the device; u @ cross is u x axis, rows
        u = along + (u - along) * cos + (u @ cross) * sin
    missed: Array = np.arccos(np.clip(u @ turn.behind, -1, 1))
    return missed
