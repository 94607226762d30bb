"""When a bias will leave its limit, by random walk, flicker, ramp and history.

After t a bias has changed by a normally distributed amount of variance

    v(t) = K^2 t + D(t) + V,     mean R t                                          (1)

with D the structure function of flicker and Gauss-Markov processes,

    D(t) = 2 s^2 (T/A (1 - exp(-A/T)))^2 (1 - exp(-t/T))                           (4)

of each, and V the variance of the calibration itself. A bias is a mean over A, as a
calibration takes it: a process that is quicker, such as that of a filter, averages out
and is white noise, which V has. With L the limit of the grade the chance to be beyond
it is

    P(t) = 1 - Phi((L - R t)/sqrt v) + Phi((-L - R t)/sqrt v)                      (2)

averaged over the draws of the sizes. A recording that shows no random walk does not
exclude one: for draws without walk, K is the largest one that would not have been seen.
If the device's history has enough calibrations, the steps d over the time h between
them give the walk over months:

    d^2 - V_1 - V_2 = K_h^2 h                                                      (3)

by maximum likelihood, and K_h replaces K. Units: s, those of the channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import TIMED_TERMS
from fieldcal.noise.prediction import SizeDraw

CHANCES = (0.05, 0.32)
"""Probabilities to be beyond the limit for which a time is stated."""

MAX_INTERVAL_S = 20 * 365.25 * 86400.0
"""Longest time that is stated, s."""

AVERAGED_S = 30.0
"""A of (4), s; the papers use 30 to 60 s."""

MIN_HISTORY_STEPS = 3
"""Fewest steps of the history from which its walk is estimated."""


class HistoryStep(NamedTuple):
    """Change of a bias from one calibration to the next.

    Attributes
    ----------
    seconds : between them
    change : in the channel's unit
    variance : of both calibrations together

    """

    seconds: float
    change: float
    variance: float


@dataclass(frozen=True, slots=True)
class Recalibration:
    """When a bias leaves its limit.

    Attributes
    ----------
    limit : in the channel's unit
    seconds : time until it is beyond the limit with each probability of `CHANCES`; inf
        if longer than `MAX_INTERVAL_S`
    from_history : whether it follows from the device's own calibrations
    by_unseen_walk : whether it follows from a walk that the recording would not show
    by_ramp : whether half of it or more is by the ramp of the recording, continued

    """

    limit: float
    seconds: tuple[float, ...]
    from_history: bool
    by_unseen_walk: bool
    by_ramp: bool


def recalibration_time(
    drawn: tuple[SizeDraw, ...],
    ramp: float,
    limit: float,
    variance: float,
    steps: Sequence[HistoryStep] = (),
    unseen: float = 0.0,
) -> Recalibration:
    """When a bias leaves its limit, (1), (2).

    Parameters
    ----------
    drawn : draws of the sizes of the processes
    ramp : units per s; used only without history
    limit : largest allowed change
    variance : V, of the calibration
    steps : of the device's history
    unseen : the largest K that the recording would not show; 0 where it shows one

    """
    seconds = np.geomspace(60.0, MAX_INTERVAL_S, 120)
    known = walk_from_history(steps) if len(steps) >= MIN_HISTORY_STEPS else None
    chance = np.zeros(len(seconds))
    for one in drawn:
        v = variance + _structure(one, seconds, known, unseen)
        root, mean = np.sqrt(v), (0.0 if known is not None else ramp * seconds)
        chance += _chance_beyond(limit, mean, root) / len(drawn)
    times = []
    for level in CHANCES:
        over = np.flatnonzero(chance > level)
        times.append(float(seconds[over[0]]) if len(over) else np.inf)
    guessed = known is None and unseen > 0 and any("K" not in d.terms for d in drawn)
    first = times[0] if np.isfinite(times[0]) else 0.0
    ramped = known is None and abs(ramp) * first > limit / 2
    return Recalibration(limit, tuple(times), known is not None, guessed, ramped)


def walk_from_history(steps: Sequence[HistoryStep]) -> float:
    """K^2 of (3) at its most likely."""
    from scipy.optimize import minimize_scalar

    h, d, v = np.array(steps).T

    def cost(log_walk: float) -> float:
        total = v + np.exp(log_walk) * h
        return float(np.sum(np.log(total) + d**2 / total))

    high = float(np.log(np.max(d**2 / h) + 1e-300))
    found = minimize_scalar(cost, bounds=(high - 20, high + 2), method="bounded")
    return float(np.exp(found.x))


def _structure(
    one: SizeDraw, seconds: Array, known: float | None, unseen: float
) -> Array:
    """Variance of the change, (1), without the calibration's own."""
    total = np.zeros(len(seconds))
    times = iter(range(len(one.terms), len(one.x)))
    for i, term in enumerate(one.terms):
        size = float(np.exp(one.x[i]))
        time = float(np.exp(one.x[next(times)])) if term in TIMED_TERMS else np.inf
        if term == "K" and known is None:
            total += size * seconds
        elif term == "G":
            kept = -np.expm1(-AVERAGED_S / time) * time / AVERAGED_S
            total += -2 * size * kept**2 * np.expm1(-seconds / time)  # (4)
        elif term in ("B", "BT"):
            # of each e-fold of correlation times from A to T, those below t have moved
            moved = np.maximum(np.minimum(seconds, time) / AVERAGED_S, 1.0)
            total += 2 * size / np.pi * np.log(moved)
    if known is None:
        return total if "K" in one.terms else total + unseen**2 * seconds
    return total + known * seconds


def _chance_beyond(limit: float, mean: Array | float, root: Array) -> Array:
    from scipy.special import ndtr

    chance: Array = 1 - ndtr((limit - mean) / root) + ndtr((-limit - mean) / root)
    return chance
