"""The position that decides between two explanations: where they differ most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.frames import turn
from fieldcal.core.samples import Array
from fieldcal.diagnosis.explain import Explanation
from fieldcal.effects import catalogue
from fieldcal.model.evidence.sets import Set
from fieldcal.model.state import State
from fieldcal.physics.experience import Experience

REACH = (0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0)
DECIDES = 5.0
"""Difference in white noise of a window's mean that decides."""


def deciding_position(
    explanation: Explanation, one: str, other: str
) -> tuple[float, float, float] | None:
    """Position at which two explanations differ most, and by how many sigmas.

    Returns
    -------
    alpha, beta in degrees and the difference, or None if no position in reach decides

    """
    rows, instead = explanation.rows, explanation.posterior.instead.get(one, {})
    if other not in instead or not rows.x.oriented.all():
        return None
    states = [_state(explanation, s) for s in (explanation.best.set, instead[other])]
    x, best = rows.x, None
    sd = np.nanmedian(rows.sd, axis=0)
    sd = sd / np.sqrt(len(x) / len(explanation.dictionary.held))
    sd = np.hypot(sd, np.nanmedian(rows.common, axis=0))
    since = explanation.dictionary.since[:, -1:]
    for alpha in REACH:
        for beta in REACH[:5]:
            place = _place(x, alpha, beta)
            seen = [s.output(s.experienced(place), since) for s in states]
            apart = float(np.nanmax(np.abs(seen[0] - seen[1]) / sd))
            if best is None or apart > best[2] * 1.2:
                best = (alpha, beta, apart)
    return best if best is not None and best[2] > DECIDES else None


def _state(explanation: Explanation, found: Set) -> State:
    """The state at a set's estimates, orientations as they are."""
    state, _ = explanation.inferred.inference.moved(found)
    return replace(state, small_rotation=np.zeros_like(state.small_rotation))


def _place(x: Experience, alpha: float, beta: float) -> Experience:
    """One row in a position, late in the session and in its window."""
    a, b = np.deg2rad([[alpha], [beta]])
    last = slice(len(x) - 1, len(x))
    force: Array = x.mounting.T @ turn(a, b) @ x.base_force
    return Experience.at_rest(
        a,
        b,
        x.gravity,
        f=force,
        t=x.t[last],
        since_start=x.since_start[last],
        since_turn=x.since_turn[last],
        warming=x.warming[last],
        heating=x.heating[last],
        variance=x.variance[last],
        position=np.array([-1]),
        base_force=x.base_force,
        base_rate=x.base_rate,
        mounting=x.mounting,
        latitude=x.latitude,
    )


def decided_by(name: str) -> str:
    """What the catalogue names to decide between an effect and others."""
    return catalogue()[name].decided_by
