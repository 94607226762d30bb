"""What devices may do to the biases of their gyroscopes, and how likely each is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

import numpy as np

from fieldcal.acceptance.tracked_bias import CASE, Cases
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array

DEPENDENCE = (0.0, 0.01, 0.03, 0.1)
"""Dependence of gyroscopes on the position, mostly g-sensitivity, as part of the spread
of their biases; all are equally likely. The Earth's rate is added except for the first,
as in a simulation."""

SPREADS = ((1.0, 0.87), (10.0, 0.1), (0.1, 0.03))
"""Spreads of biases, as parts of that from run to run, with the share of devices that
have them: usual ones, lower grades than stated, and biases that were calibrated."""

WALKS = (0.0, 1e-3, 1e-2, 1e-1)
"""Slow changes of a bias in `WALK_S`, as parts of the spread from run to run."""

WALK_S = 30.0
"""Time of `WALKS`, s."""

PUT_IN = (0.0, 0.1, 1.0)
"""What a turn puts into a bias that is kept, or into that which is subtracted, as parts
of the same spread."""

TIME_CONSTANTS = np.geomspace(0.25, 512.0, 12)
"""Time constants with which a bias may be followed, s."""

AVERAGES = np.geomspace(0.25, 16.0, 13)
"""Times over which it may be averaged, s."""

SETTLES_S, SETTLES_PART = 0.5, 1.2
"""Time after a turn from which an average is subtracted: s, and in times of its own."""


@dataclass(frozen=True, slots=True)
class BiasSpread:
    """Possible biases of gyroscopes from which none is subtracted.

    Attributes
    ----------
    repeat : spread from run to run, 1 sigma, rad/s
    averaged : whether the device reports a constant offset that it subtracts
    stated : whether it is stated that the device subtracts none at rest

    """

    repeat: float
    averaged: bool = False
    stated: bool = False


def followed_cases(keeps: BiasSpread, density: Array) -> Cases:
    """Cases in which the bias is followed, behind noise of (a,) (rad/s)^2 s."""
    usual, psd = keeps.repeat**2, float(density.mean())
    return _cases(
        (tau, start, w, part**2 * usual, walk, 0.0)
        for tau, w, part, walk in product(
            TIME_CONSTANTS, _felt(keeps), PUT_IN, _walks(keeps)[:2]
        )
        for start in (usual, w + psd)  # the latter if it has rested for a second
    )


def averaged_cases(density: Array) -> Cases:
    """Cases in which a mean is subtracted until the next turn, one for each time."""
    psd = float(density.mean())
    return _cases(
        (np.inf, 0.0, psd / s, 0.0, 0.0, SETTLES_PART * s + SETTLES_S) for s in AVERAGES
    )


def kept_cases(keeps: BiasSpread, density: Array, blind: float) -> Cases:
    """Cases in which the bias is kept, of which a time after each turn is not used."""
    usual = keeps.repeat
    starts = [((part * usual) ** 2, share) for part, share in SPREADS]
    if keeps.averaged:
        left = [float(density.mean() / s) for s in AVERAGES]
        starts = [(start, share / 2) for start, share in starts]
        starts += [(var, 0.5 / len(left)) for var in left]
    rows = [
        ((np.inf, start, w, (part * usual) ** 2, walk, blind), share)
        for (start, share), w, part, walk in product(
            starts, _felt(keeps), PUT_IN, _walks(keeps)
        )
    ]
    cases = _cases(row for row, _ in rows)
    weights = np.array([share for _, share in rows])
    cases["share"] = weights / weights.sum()
    return cases


def way_of_removal(case: Cases) -> str:
    """How a device of a case removes its bias, in words."""
    if np.isfinite(case["tau"]):
        return f"with a time constant of about {case['tau']:.2g} s"
    average = (case["blind"] - SETTLES_S) / SETTLES_PART
    return f"as a mean over about {average:.2g} s after each turn"


def _cases(rows: Iterable[tuple[float, ...]]) -> Cases:
    """Equally likely cases from rows of their values."""
    every = np.array([*rows], dtype=float)
    cases = np.zeros(len(every), dtype=CASE)
    for name, column in zip(CASE.names or (), every.T, strict=False):
        cases[name] = column
    cases["share"] = 1 / len(every)
    return cases


def _walks(keeps: BiasSpread) -> list[float]:
    """Variances by which a bias may change in a second."""
    return [(part * keeps.repeat) ** 2 / WALK_S for part in WALKS]


def _felt(keeps: BiasSpread) -> list[float]:
    """Variances of the rate that a gyroscope feels by how the device lies."""
    earth = EARTH_RATE**2 / 3
    return [(d * keeps.repeat) ** 2 + (earth if d else 0.0) for d in DEPENDENCE]
