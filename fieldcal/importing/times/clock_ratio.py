"""Times of two sensors of one log that count different units."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

RATIOS = tuple(10.0**n for n in (3, -3, 6, -6, 9, -9))
"""How often one unit of times is in another: s, ms, us and ns."""

ALONGSIDE = 0.9
"""Share of the longer recording during which both sensors run, in the right units."""

FAR = 10.0
"""Times that what lies between two spans is longer than these, of other clocks."""


def clock_ratio(t: Array, others: Array, part: bool = False) -> float | None:
    """By what times (m,) of a sensor are multiplied to be in the unit of others (n,).

    None where no unit makes the two run at the same time: their clocks begin at
    different zeros. `part` says that these are the first times of longer ones.

    >>> t = np.arange(0.0, 3000.0, 10.0)
    >>> clock_ratio(t, t / 1000 + 0.003), clock_ratio(t, t + 5), clock_ratio(t, t + 4e5)
    (1000.0, 1.0, None)
    """
    t, others = t[np.isfinite(t)], others[np.isfinite(others)]
    if min(len(t), len(others)) < 2 or not (np.ptp(t) and np.ptp(others)):
        return 1.0
    if _alongside(t, others) > 1 - ALONGSIDE:
        return 1.0
    fitting = [one for one in RATIOS if _alongside(t, others * one) > ALONGSIDE]
    if fitting:
        return fitting[0]
    least = -FAR if part else 0.0
    return 1.0 if _alongside(t, others) > least else None


def _alongside(t: Array, others: Array) -> float:
    """Share of the longer span that lies in both; less than 0, what lies between."""
    both = min(t.max(), others.max()) - max(t.min(), others.min())
    return float(both / max(np.ptp(t), np.ptp(others)))


def say_apart(t: Array, others: Array, force: str, rate: str) -> str:
    """Say that two sensors have no times in common."""
    spans = [f"{one.min():.10g} to {one.max():.10g}"
             for one in (t[np.isfinite(t)], others[np.isfinite(others)])]  # fmt: skip
    return (
        f"the times of {force}, {spans[0]}, and of {rate}, {spans[1]}, have nothing in"
        " common in any unit: they are of two clocks. Write both by one clock, or"
        " import a file of one alone"
    )


def say_ratio(ratio: float, rate: str) -> list[str]:
    """Say in which unit times were taken, if it is another."""
    if ratio == 1:
        return []
    many = f"{ratio:.0f} times as long as" if ratio > 1 else f"1/{1 / ratio:.0f} of"
    return [f"a unit of the times of {rate} is taken for {many} one of the"
            " accelerometer's: so both run at the same time"]  # fmt: skip
