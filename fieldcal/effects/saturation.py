"""Outputs that stop at full scale.

    U = min(max(U, -limit), limit)

Found where a channel's largest or smallest value is taken again and again: at the
declared range, or far more often than the value next to it: in several places, or in
one that the channel runs into and comes out of. Two axes that stop at the same value
need not come out of it: each of its own would stick anywhere. Source: model of this
project.

>>> import numpy as np
>>> signal = np.clip(np.sin(np.arange(200) / 7.0), -0.9, 0.9)
>>> [(float(signal[rows[0]]), len(rows)) for rows in samples_at_rails(signal, np.nan)]
[(-0.9, 28), (0.9, 35)]
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, runs_of_true
from fieldcal.physics.effect import Chain, Param
from fieldcal.physics.recording import CheckedSamples, Fault, Rows

MIN_RAIL_SAMPLES = 5
"""Smallest number of samples at a rail."""

RAIL_RATIO = 4.0
"""Ratio of samples at the rail to samples at the value next to it."""

SAME = 1e-6
"""Relative difference of values that are the same but for their conversion."""

UNDER_WAY = 5
"""Number of samples next to a run that must move towards the rail."""

PACE = 3.0
"""Largest last step to the rail, in mean steps before it."""

CHANCE = 3.0
"""Difference of two counts that is significant, in standard deviations."""


def samples_at_rails(values: Array, limit: float, coarse: bool = False) -> list[Rows]:
    """Samples at each rail of a channel; none where there is no rail.

    `limit` is the declared full scale, nan where unknown; `coarse` says that any value
    is taken again and again, so that this alone makes no rail.
    """
    out = []
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    alike = low < 0 and abs(high + low) < 1e-3 * high and not np.isfinite(limit)
    for edge in dict.fromkeys((low, high)):
        at = np.flatnonzero(values == edge)
        if len(at) < MIN_RAIL_SAMPLES:
            continue
        declared = abs(abs(edge) - limit) < 1e-3 * limit
        beside = _neighbour_count(values, edge)
        apart = bool((np.diff(at) > 1).any()) or _moves_into_rail(values, at)
        often = apart and 0 < RAIL_RATIO * beside + MIN_RAIL_SAMPLES < len(at)
        # as far down as up is full scale only if more is there than beside it: gravity
        # on both faces of a box is as much up as down, and its noise thins outwards
        chance = CHANCE * (len(at) + beside) ** 0.5
        piled = alike and 0 < beside < len(at) - chance
        if declared or (not coarse and (often or piled)):
            out.append(at)
    return out


def _moves_into_rail(values: Array, at: Rows) -> bool:
    """Whether a channel moves steadily into the single run at a rail, and out of it.

    One that stands still where it happened to be goes on with a jump.
    """
    edge = values[at[0]]
    for beside in (values[: at[0]][: -UNDER_WAY - 1 : -1], values[at[-1] + 1 :]):
        way = np.abs(edge - beside[:UNDER_WAY])
        if len(way) < UNDER_WAY or (np.diff(way) <= 0).any():
            return False
        if way[0] > PACE * (way[-1] - way[0]) / (UNDER_WAY - 1):
            return False
    return True


def _neighbour_count(values: Array, edge: float) -> int:
    """Number of samples at the value next to an edge; 0 if there is no other value."""
    inner = values[np.isfinite(values) & (values != edge)]
    if not len(inner):
        return 0
    return int((inner == inner[np.argmin(np.abs(inner - edge))]).sum())


class Saturation(Chain):
    """Clipping at full scale."""

    params = (Param("limit", "m/s^2 or rad/s", 1e3),)
    covariate = "samples at the rail"
    treatment = "mask"
    decided_by = "a larger range, positions that load the axis less, or slower turns"
    cure = "Choose a larger range, positions that load the axis less, or slower turns."
    source = "model of this project"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """Find channels with samples at a rail; the axes of a triad share the limit."""
        out = []
        for first in (0, 3):
            # a channel at its rail all the time shows no noise of its own
            noise = float(np.nanmax(recording.noise[first : first + 3], initial=0.0))
            limit, found = float(recording.limits[first // 3]), {}
            if np.isnan(limit):
                limit = _common_rail(recording, first, noise)
            for _ in range(2):
                for c in range(first, first + 3):
                    if c not in found and len(
                        at := _at_rails(recording, c, limit, noise)
                    ):
                        found[c] = at
                if not found:
                    break
                limit = float(max(_size(recording, c, at) for c, at in found.items()))
            out += [_fault(recording, c, found[c], noise) for c in sorted(found)]
        return out


def _at_rails(recording: CheckedSamples, c: int, limit: float, noise: float) -> Rows:
    """Samples of a channel at its rails, which may change with its range.

    `noise` is that of its triad.
    """
    values, out = recording.channel(c), [np.empty(0, dtype=np.intp)]
    for first, last, step in recording.grids.stretches(c, len(values)):
        part = values[first:last]
        if np.isfinite(part).any():
            out += [first + at for at in samples_at_rails(part, limit, step > noise)]
    return np.sort(np.concatenate(out))


def _common_rail(recording: CheckedSamples, first: int, noise: float) -> float:
    """Value at which two axes of a triad stop, each for a while; nan if none do.

    No axis of the triad may go beyond it.
    """
    sizes: list[float] = []
    triad = [recording.channel(c) for c in range(first, first + 3)]
    largest = float(np.nanmax(np.abs(triad), initial=0.0))
    for c, values in enumerate(triad, first):
        own = set[float]()
        for start, end, step in recording.grids.stretches(c, len(values)):
            part = values[start:end]
            if not noise > step or not np.isfinite(part).any():
                continue
            for edge in (float(np.nanmin(part)), float(np.nanmax(part))):
                runs = runs_of_true(part == edge)
                if len(runs) and np.diff(runs).max() >= MIN_RAIL_SAMPLES:
                    own.add(abs(edge))
        sizes += own
    at_largest = [s for s in sizes if s > 0 and abs(s - largest) <= SAME * largest]
    return largest if len(at_largest) > 1 else np.nan


def _size(recording: CheckedSamples, c: int, rows: Rows) -> float:
    return float(np.abs(recording.channel(c)[rows]).max())


def _fault(recording: CheckedSamples, c: int, rows: Rows, noise: float) -> Fault:
    limit, t = _size(recording, c, rows), recording.block.t
    return Fault(
        channel=CHANNELS[c],
        values={"channel": CHANNELS[c], "limit": limit},
        sigmas={"limit": noise},
        from_s=float(t[rows[0]]),
        to_s=float(t[rows[-1]]),
        rows=rows,
        size=limit,
    )
