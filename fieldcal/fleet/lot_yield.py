"""The yield of a lot with its interval.

A yield of k good units of n has the interval of Jeffreys,

    Beta(k + 1/2, n - k + 1/2)                                                      (1)

Source: Brown, Cai and DasGupta, Statistical Science 16 (2001) 101.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scipy.special import betaincinv

if TYPE_CHECKING:
    from fieldcal.fleet.lot import LotAnalysis


def yield_sentence(found: LotAnalysis) -> str:
    """The yield, with its 95 % interval, and why units are not among the good ones."""
    share, low, high = (100 * part for part in found.yield_share)
    said = (
        f"{found.good} of {found.judged}: {share:.1f} % (95 %: {low:.1f} to"
        f" {high:.1f} %)"
    )
    bad, missing = found.judged - found.good - found.unmeasured, found.unmeasured
    parts = [(bad, "NO-GO or not good"), (missing, "without a result")]
    why = ", ".join(f"{n} {what}" for n, what in parts if n)
    return f"{said}; {why}" if why else said


def yield_interval(good: int, count: int) -> tuple[float, float, float]:
    """Share of good units, and the lower and upper end of its 95 % interval, (1).

    >>> [round(x, 3) for x in yield_interval(9, 10)]
    [0.9, 0.619, 0.989]
    """
    a, b = good + 0.5, count - good + 0.5
    low = 0.0 if not good else float(betaincinv(a, b, 0.025))
    high = 1.0 if good == count else float(betaincinv(a, b, 0.975))
    return good / count, low, high
