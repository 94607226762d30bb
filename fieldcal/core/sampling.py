"""Sampling rate of a block, and whether samples follow one another without a pause."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block

STEPS_USED = 100_000
"""Steps between samples from which the rate is estimated, at most."""

BURST_SPAN = 50
"""Samples over which the mean step is right also where stamps come in bursts."""

PAUSE_PERIODS = 3.5
"""Time without a sample that counts as a pause, in sampling periods."""

REGULAR = 0.2
"""Spread of the steps, in steps, up to which times can show a loss."""

BURST_RATIO = 2.0
"""Samples whose mean step is so many times their usual one come in bursts."""


def sampling_rate(block: Block) -> float:
    """Sampling rate, Hz, from the times of the samples."""
    if len(block) < 2:
        return 1.0
    first = np.arange(0, len(block) - 1, max(len(block) // STEPS_USED, 1))
    step = float(np.median(block.t[first + 1] - block.t[first]))
    over = (
        block.t[BURST_SPAN::BURST_SPAN] - block.t[:-BURST_SPAN:BURST_SPAN]
    )  # stamps may come in bursts
    return 1 / max(step, float(np.median(over)) / BURST_SPAN if len(over) else 0.0)


def has_no_pause(t: Array, first: int, last: int, rate: float) -> bool:
    """Whether there is no pause from the sample before `first` to that after the last.

    Parameters
    ----------
    t : (n,) times of all samples, s
    first, last : of these samples the first and one past the last
    rate : samples a second

    >>> t = np.array([0.0, 0.1, 0.2, 5.2, 5.3, 5.4])
    >>> [has_no_pause(t, i, j, 10.0) for i, j in ((1, 2), (1, 3), (4, 6))]
    [True, False, True]
    """
    steps = np.diff(t[max(first - 1, 0) : last + 1])
    return not (steps > PAUSE_PERIODS / rate).any()


def shows_losses(t: Array) -> bool:
    """Whether a missing sample shows as a gap in the times (n,).

    It does not where steps are uneven, or where times come in bursts, as when a host
    stamps what its buffer held.

    >>> t = np.arange(200) * 0.01
    >>> shows_losses(t), shows_losses(np.floor(t / 0.1) * 0.1 + 1e-4 * (t % 0.1))
    (True, False)
    """
    step = np.diff(t)
    if not len(step):
        return True
    usual = float(np.median(step))
    if np.median(np.abs(step - usual)) > REGULAR * usual:
        return False
    over = t[BURST_SPAN::BURST_SPAN] - t[:-BURST_SPAN:BURST_SPAN]
    return not (len(over) and np.median(over) > BURST_RATIO * BURST_SPAN * usual)
