"""Positions and turns that take the virtual device through a session again.

It is held at the angles of session.toml with the errors that were found, or, where no
angles are known, at those that give the measured force. From one position to the next
it moves as the gyroscopes measured; otherwise a turn ends when the device came to rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.model.state import State
from fieldcal.model.system.fitted import FittedSet
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.experience import Experience
from fieldcal.physics.experience_rows import select_rows
from fieldcal.sim_device.replay import HeldWindow
from fieldcal.twin.ways import manoeuvre_of_turn

ROW_SAMPLES = 24
"""Samples of a row that are simulated for its mean, without oscillations."""

TURN_S = 4.0
"""Longest turn, s."""

PUT_S = 60.0
"""Time at rest before the turn to the first window, s."""


def replay_windows(
    explanation: Explanation,
    state: State,
    fitted: FittedSet,
    shaken: Array,
    turns: Sequence[Turn],
) -> list[HeldWindow]:
    """The session's windows in time order, from its start, with their turns.

    `state` gives the orientation in each, `shaken` (p,) the vibration there, m/s^2;
    `turns` are those that the gyroscopes measured.
    """
    source, x = explanation.prepared.source, fitted.rows.x
    start, t = float(source.block.t[0]), source.block.t
    felt, arrived = state.experienced(x).f, _rest_onsets(state, fitted)
    out: list[HeldWindow] = []
    bounds = window_bounds(source.block, source.about)
    ways = {turn.positions[1]: manoeuvre_of_turn(turn, start) for turn in turns}
    for p in sorted(np.unique(x.position), key=lambda p: int(bounds[p, 0])):
        row = int(np.argmax(x.position == p))
        alpha, beta = _joint_angles(state, select_rows(x, [row]), felt[row])
        begin, end = (float(v) - start for v in (t[bounds[p, 0]], t[bounds[p, 1] - 1]))
        if not out and np.isfinite(arrived[row]):  # put there not long before
            out.append(HeldWindow(alpha, beta, begin - PUT_S, begin - PUT_S + 1.0))
        before = out[-1].end if out else -PUT_S
        rest = float(np.clip(arrived[row] - start, before, begin))
        way = ways.get(p)
        moves = max(rest - TURN_S, before) if way is None else float(way.t[0])
        out.append(
            HeldWindow(
                alpha,
                beta,
                begin,
                end,
                tuple(x.rate[row].tolist()),
                (moves, rest) if rest > moves else None,
                float(shaken[p]),
                way,
            )
        )
    return out


def _joint_angles(state: State, x: Experience, felt: Array) -> tuple[float, float]:
    """Angles, rad, to which the joints are set in a position.

    Where no angles are known, or three, they are those that give the measured force
    `felt` (3,), m/s^2, with the errors of the base and of the joints' gauges.
    """
    if x.oriented[0] and not x.gamma[0]:
        small = state.small_rotation[x.position[0]]
        return float(x.alpha[0] + small[0]), float(x.beta[0] + small[1])
    state = replace(state, small_rotation=np.zeros_like(state.small_rotation))
    asked = np.array([0.0, 1.0])
    gauged = state.experienced(select_rows(x, [0, 0]).turned(alpha=asked, beta=asked))
    there = _angles_for_force(gauged.base_force, x.mounting @ felt)
    out = []
    for angle, read in zip(there, (gauged.alpha, gauged.beta), strict=True):
        out.append(float((angle - read[0]) / (read[1] - read[0])))
    return out[0], out[1]


def _angles_for_force(base: Array, seen: Array) -> tuple[float, float]:
    """Angles alpha, beta, rad, that turn a force in base axes to that seen, (3,) each.

    With v = (., b_y cos a - b_x sin a, b_z) after the first joint, in unit vectors,

        b_x cos a + b_y sin a = s_x,    b = arg(v_y + i v_z) - arg(s_y + i s_z)
    """
    x, y, z = base / np.linalg.norm(base)
    s = seen / np.linalg.norm(seen)
    rise = np.arcsin(np.clip(s[0] / np.hypot(x, y), -1.0, 1.0))
    pairs = []
    for first in (rise, np.pi - rise):
        a = first - np.arctan2(x, y)
        b = np.arctan2(z, y * np.cos(a) - x * np.sin(a)) - np.arctan2(s[2], s[1])
        pairs.append([float(np.angle(np.exp(1j * angle))) for angle in (a, b)])
    alpha, beta = min(pairs, key=lambda pair: abs(pair[1]))
    return alpha, beta


def _rest_onsets(state: State, fitted: FittedSet) -> Array:
    """Instant by row, (n,) s, at which the device came to rest, for settling."""
    x, since = fitted.rows.x, fitted.dictionary.since
    arrived: Array = x.t - since[max((t.origin for t in state.terms), default=0)]
    return arrived


def replay_instants(t: Array, span: Array, most: int, turns: Sequence[Turn]) -> Array:
    """Times of simulated samples: at most `most` in each row, and those of turns."""
    first = np.searchsorted(t, span[:, 0], side="left")
    last = np.searchsorted(t, span[:, 1], side="right")
    some = [np.searchsorted(t, turn.t) for turn in turns]
    for a, b in zip(first, last, strict=True):
        every = np.linspace(a, b - 1, min(most, b - a))
        some.append(np.round(every).astype(np.intp))
    return t[np.unique(np.concatenate(some))]
