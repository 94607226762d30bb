"""Why a still stretch begins and ends, in words.

The second beyond its end shows the reason: end of the recording, a pause, a rotation, a
changing acceleration, or a disturbance after which the device rests as before.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import CHANNELS, UNITS, Array
from fieldcal.windows.cells import CELL, CellRows, CellTable
from fieldcal.windows.rests import cell_index

BEYOND = 1.0
"""Time beyond a stretch that is evaluated, s."""

MIN_PAUSE_S = 1.0
"""Time without a cell that is a pause, s."""

TURNS = 0.02
"""Difference of a rate from that in the stretch that is a rotation, rad/s."""

DEPARTURE_SPREADS = 4.0
"""Least departure from a stretch, in standard deviations of its cell means."""


def stretch_end_reasons(
    rows: CellRows, origin: Array, spans: Sequence[tuple[float, float]]
) -> list[tuple[str, str]]:
    """Say what precedes each stretch, and what ends it.

    Parameters
    ----------
    rows, origin : cells of the recording, as `still_stretches_of_file` has them
    spans : start and end of each stretch, s of device time, in order

    """
    out = []
    for start, end in spans:
        first, last = cell_index(rows, start), cell_index(rows, end)
        inside = CellTable(rows[first : last + 1][:, 0], rows[first : last + 1][:, 1:],
                           origin)  # fmt: skip
        k = round(BEYOND / CELL)
        before, after = rows[max(0, first - k) : first], rows[last + 1 : last + 1 + k]
        out.append(
            (
                _end_reason(before[::-1], inside, origin, -1),
                _end_reason(after, inside, origin, 1),
            )
        )
    return out


def _end_reason(beyond: Array, inside: CellTable, origin: Array, side: int) -> str:
    """Reason of one end of a stretch; `beyond` are the cells outside, nearest first."""
    edge = inside.times[-1 if side > 0 else 0]
    steps = np.abs(np.diff(beyond[:, 0], prepend=edge)) - inside.period
    paused = np.flatnonzero(steps > MIN_PAUSE_S)
    near = beyond[: paused[0]] if len(paused) else beyond
    if phrase := _motion_phrase(near, inside, origin):
        return phrase
    if len(paused):
        return f"a pause of {steps[paused[0]]:.3g} s"
    if len(beyond) < round(BEYOND / CELL):
        return "the recording ends" if side > 0 else "the recording begins"
    return "it is cut, for it changes slowly"


def _motion_phrase(near: Array, inside: CellTable, origin: Array) -> str:
    """Phrase about the motion in cells beside a stretch; "" without motion."""
    if not len(near):
        return ""
    cells = CellTable(near[:, 0], near[:, 1:], origin)
    means = np.nan_to_num(inside.means)
    level, own = np.median(means, axis=0), means.std(axis=0)
    off = np.nan_to_num(cells.means - level)
    rate = np.abs(off[:, 3:])
    if rate.max() > TURNS:
        axis = int(np.argmax(rate.max(axis=0)))
        text = f"{CHANNELS[3 + axis]} reaches {rate[:, axis].max():.2g} {UNITS[3]}"
        return f"it is turned: {text}"
    ratio = np.abs(off) / np.maximum(own, 1e-12)
    if ratio.max() < DEPARTURE_SPREADS:
        return ""
    channel = int(np.argmax(ratio.max(axis=0)))
    size = float(np.abs(off[:, channel]).max())
    text = f"{CHANNELS[channel]} by {size:.2g} {UNITS[channel]}"
    lasts = np.abs(off[-1, channel]) > size / 2
    return f"it moves: {text}" if lasts else f"a disturbance: {text}"
