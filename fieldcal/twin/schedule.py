"""What the virtual device is told, so that it goes through a session again.

It is held where the windows held it, as far as a fit knows that: at the angles of
session.toml with the turns aside that were found, or, where none are known, at those
that bring about the force that was felt. From one to the next it is carried as the
gyroscopes tell; where they do not, a turn ends when the device came to rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.model import State
from fieldcal.diagnosis.reduce import spans
from fieldcal.diagnosis.turns import Turn
from fieldcal.frames import angles_of
from fieldcal.samples import Array
from fieldcal.sim_device.replay import Window
from fieldcal.twin.ways import way_of

ENOUGH = 24
"""Samples of a row that give its mean, where nothing oscillates."""

TURN_S = 4.0
"""A turn takes at most so long."""

PUT_S = 60.0
"""The device had stood somewhere for so long before the first window, s."""


def windows(
    explanation: Explanation,
    state: State,
    bench: Bench,
    shaken: Array,
    turns: Sequence[Turn],
) -> list[Window]:
    """The session's windows in time order, from its start, with their turns.

    `state` says where the device was in each, `shaken` (p,) is its vibration there,
    m/s^2; `turns` are those that the gyroscopes have followed.
    """
    source, x = explanation.prepared.source, bench.rows.x
    start, t = float(source.block.t[0]), source.block.t
    felt = state.experienced(x)
    out: list[Window] = []
    bounds = spans(source.block, source.about)
    ways = {turn.positions[1]: way_of(turn, start) for turn in turns}
    for p in sorted(np.unique(x.position), key=lambda p: int(bounds[p, 0])):
        row = int(np.argmax(x.position == p))
        if x.oriented[row]:
            aside = state.aside[p] if len(state.aside) > p else np.zeros(2)
            alpha, beta = float(x.alpha[row] + aside[0]), float(x.beta[row] + aside[1])
        else:
            alpha, beta = angles_of(x.mounting @ felt.f[row])
        begin, end = (float(v) - start for v in (t[bounds[p, 0]], t[bounds[p, 1] - 1]))
        if not out and np.isfinite(source.arrived[p]):  # put there not long before
            out.append(Window(alpha, beta, begin - PUT_S, begin - PUT_S + 1.0))
        before = out[-1].end if out else -PUT_S
        rest = float(np.clip(source.arrived[p] - start, before, begin))
        way = ways.get(p)
        moves = max(rest - TURN_S, before) if way is None else float(way.t[0])
        out.append(
            Window(
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


def instants(t: Array, span: Array, most: int, turns: Sequence[Turn]) -> Array:
    """Sample times: in each row `most` evenly spread at most, and edges of turns."""
    first = np.searchsorted(t, span[:, 0], side="left")
    last = np.searchsorted(t, span[:, 1], side="right")
    some = [np.searchsorted(t, turn.t) for turn in turns]
    for a, b in zip(first, last, strict=True):
        every = np.linspace(a, b - 1, min(most, b - a))
        some.append(np.round(every).astype(np.intp))
    return t[np.unique(np.concatenate(some))]
