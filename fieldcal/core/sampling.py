"""How often samples come, and whether they come without a pause."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block

STEPS = 100_000
"""Steps between samples that tell the rate; more would only take time."""

SPAN = 50
"""Samples over which stamps that come in bursts are even."""

PAUSE = 3.5
"""Periods without a sample that are a pause: what went on in it nobody knows."""


def rate_of(block: Block) -> float:
    """Samples a second, from the times."""
    if len(block) < 2:
        return 1.0
    first = np.arange(0, len(block) - 1, max(len(block) // STEPS, 1))
    step = float(np.median(block.t[first + 1] - block.t[first]))
    over = block.t[SPAN::SPAN] - block.t[:-SPAN:SPAN]  # stamps may come in bursts
    return 1 / max(step, float(np.median(over)) / SPAN if len(over) else 0.0)


def unbroken(t: Array, first: int, last: int, rate: float) -> bool:
    """Whether samples come without a pause from before one to that behind a last.

    Parameters
    ----------
    t : (n,) times of all samples, s
    first, last : of these samples the first and one past the last
    rate : samples a second

    >>> t = np.array([0.0, 0.1, 0.2, 5.2, 5.3, 5.4])
    >>> unbroken(t, 1, 2, 10.0), unbroken(t, 1, 3, 10.0), unbroken(t, 4, 6, 10.0)
    (True, False, True)
    """
    steps = np.diff(t[max(first - 1, 0) : last + 1])
    return not (steps > PAUSE / rate).any()
