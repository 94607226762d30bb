"""Axes of gyroscopes that differ from those of the accelerometers, found from turns.

Between two rests gravity turns in the device as the rates w say that the device turned:

    f_q = R(P w) f_p,   R(w) = ... exp(-[w_2 x]dt) exp(-[w_1 x]dt)                  (1)

P is one of the 48 signed permutations. With its proper part Q = det(P) P it is

    R(P w) = Q R(det(P) w) Q^T                                                      (2)

so that two integrations tell of all of them. Source: rotation kinematics.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from fieldcal.core.rotation import cross, rotation_matrices
from fieldcal.core.samples import Array

MIN_TURNS = 3
"""Least number of turns: one turn closes under several permutations by chance."""

FOLLOWED = 0.8
"""Share of turns that must close: one may have gone on beyond what a rest was taken
for, or have been clipped."""

CLOSES = np.deg2rad(8.0)
"""What a turn that closes misses by at most, rad: biases of half a m/s^2 and scale
factors off by a few percent leave less."""

MIN_CLOSURE_RATIO, SAME_CLOSURE_RAD = 3.0, np.deg2rad(0.5)
"""How much more others miss by, and what makes no difference, rad."""


class ObservedTurn(NamedTuple):
    """A turn between two rests.

    Attributes
    ----------
    before, behind : (3,) force at rest, in the axes of the accelerometers
    angles : (m, 3) rad, rates times their durations, in the axes of the gyroscopes

    """

    before: Array
    behind: Array
    angles: Array


def signed_axes() -> list[Array]:
    """All 48 signed permutations (3, 3), the identity first."""
    return [
        np.diag(signs) @ np.eye(3)[list(order)]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]


def axes_by_turns(turns: Sequence[ObservedTurn]) -> Array | None:
    """P by which the turns close, (3, 3), if they do not close as declared; else None.

    None also if several close them, as of turns about a single axis. If only the sense
    of one axis is undetermined, the device is taken to be right-handed.
    """
    if len(turns) < MIN_TURNS:
        return None
    every = signed_axes()
    if _missed_angles(turns, every[:1])[0] < CLOSES:
        return None
    missed = _missed_angles(turns, every)
    if missed.min() > CLOSES:
        return None
    near = np.flatnonzero(
        missed <= MIN_CLOSURE_RATIO * max(missed.min(), SAME_CLOSURE_RAD)
    )
    if len(near) > 1:
        # about two axes the third goes by itself, and devices are right-handed
        near = np.array([i for i in near if np.linalg.det(every[i]) > 0])
    return every[near[0]] if len(near) == 1 else None


def _missed_angles(turns: Sequence[ObservedTurn], every: Sequence[Array]) -> Array:
    """What most turns miss by at most with each P, rad."""
    each = [_closure_angles(one, every) for one in turns]
    # few axes are turned about in many turns; a fifth may have been followed badly
    missed: Array = np.quantile(each, FOLLOWED, axis=0, method="higher")
    return missed


def _closure_angles(turn: ObservedTurn, every: Sequence[Array]) -> list[float]:
    """Angle between where gravity is and where each P leads it, rad, (1)."""
    signs = [round(float(np.linalg.det(axes))) for axes in every]
    ways = {sign: _rotation_product(sign * turn.angles) for sign in {*signs}}
    out = []
    for axes, sign in zip(every, signs, strict=True):
        proper = sign * axes
        led = proper @ ways[sign] @ proper.T @ turn.before  # (2)
        sine = float(np.linalg.norm(cross(led, turn.behind)))
        out.append(float(np.arctan2(sine, led @ turn.behind)))
    return out


def _rotation_product(angles: Array) -> Array:
    """Product of all steps, (3, 3), the last at the left."""
    steps = rotation_matrices(-angles)
    while len(steps) > 1:
        if len(steps) % 2:
            steps = np.concatenate([steps, np.eye(3)[None]])
        steps = steps[1::2] @ steps[::2]
    whole: Array = steps[0] if len(steps) else np.eye(3)
    return whole
