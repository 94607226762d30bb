"""Samples that are missing from the stream.

Found as gaps in the times against their usual step, or in the device's counter.
`fraction` is of all samples sent. Times that come in bursts, as when a host stamps what
its buffer held, show none: their gaps are no multiples of a step. Source: model of this
project.

>>> import numpy as np
>>> t = np.delete(np.arange(100) * 0.01, [20, 21, 50])
>>> count_missing_samples(t).sum()
np.int64(3)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.core.sampling import shows_losses
from fieldcal.physics.effect import Chain, Param
from fieldcal.physics.recording import CheckedSamples, Fault

PAUSE_S = 5.0
"""A gap outside windows that is longer is a pause of the recording, not a loss."""

WHOLE = 0.15
"""Mean distance of gaps from whole steps, in steps, up to which samples are missing."""

MIN_DROPPED = 2


def count_missing_samples(t: Array) -> NDArray[np.int_]:
    """Samples missing after each sample but the last, (n - 1,)."""
    step = np.diff(t)
    lost: NDArray[np.int_] = np.zeros(len(step), dtype=int)
    if not shows_losses(t):
        return lost
    usual = np.median(step)
    lost = np.maximum(np.round(step / usual).astype(int) - 1, 0)
    gaps = step[lost > 0] / usual
    if len(gaps) and np.mean(np.abs(gaps - np.round(gaps))) > WHOLE:
        lost[:] = 0
    return lost


def _is_pause(recording: CheckedSamples) -> NDArray[np.bool_]:
    """Whether the recording paused after each sample but the last, (n - 1,).

    A long time outside windows is a pause, and so is all the time between two windows.
    So is what is damaged in the file: it says nothing of the link.
    """
    still = recording.still
    starts = np.zeros(len(still), dtype=bool)
    starts[recording.windows[recording.windows[:, 0] < len(still), 0]] = True
    outside = ~(still[:-1] & still[1:]) | starts[1:]
    all_of_it = still[:-1] & starts[1:]
    paused: NDArray[np.bool_] = all_of_it | (
        outside & (np.diff(recording.block.t) > PAUSE_S)
    )
    t = recording.block.t
    for start, end in recording.without:
        paused |= (t[:-1] >= np.nextafter(start, -np.inf)) & (t[1:] <= end)
    return paused


class Dropped(Chain):
    """Lost samples."""

    params = (Param("fraction", "1", 0.1),)
    covariate = "gaps in the times or the counter"
    place = 1
    decided_by = "the link's own count of lost frames"
    cure = "Lower the rate or raise the baud rate; look at cable and connectors."
    source = "model of this project"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """Samples lost, as a fraction."""
        block = recording.block
        if len(block) < 10:
            return []
        lost = count_missing_samples(block.t)
        if np.isfinite(block.seq).all():
            jumps = np.diff(block.seq)
            usual = np.median(jumps)
            if usual > 0:  # a counter that wraps goes back, and tells nothing there
                counted = np.where(jumps > 0, np.round(jumps / usual) - 1, 0)
                lost = np.maximum(lost, counted.astype(int))
        lost = np.where(_is_pause(recording), 0, lost)
        total = int(lost.sum())
        if total < MIN_DROPPED:
            return []
        sent = len(block) + total
        at = np.flatnonzero(lost)
        return [
            Fault(
                channel="t",
                values={"fraction": total / sent},
                sigmas={"fraction": float(np.sqrt(total)) / sent},
                from_s=float(block.t[at[0]]),
                to_s=float(block.t[at[-1] + 1]),
                size=float(lost.max()),
            )
        ]
