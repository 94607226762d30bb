"""When a bias will leave its limit, by random walk, flicker, ramp and history.

After t a bias has changed by a normally distributed amount of variance

    v(t) = K^2 t + D(t) + V,     mean R t                                          (1)

with D the structure function of flicker and Gauss-Markov processes,

    D(t) = 2 s^2 (T/A (1 - exp(-A/T)))^2 (1 - exp(-t/T))                           (2)

of each, and V the variance of the calibration itself. A bias is a mean over A, as a
calibration takes it: a process that is quicker, such as that of a filter, averages out
and is white noise, which V has. With L the limit of the grade the chance to be beyond
it is

    P(t) = 1 - Phi((L - R t)/sqrt v) + Phi((-L - R t)/sqrt v)                      (3)

averaged over the draws of the sizes. A recording that shows no random walk does not
exclude one: for draws without walk, K is the largest one that would not have been seen.
If the device's history has enough calibrations, their changes show the walk over months
(`history_walk`), which replaces K and the ramp; P is averaged over its density as well.
Units: s, those of the channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.history_walk import EarlierBias, walk_from_history
from fieldcal.noise.likelihood import TIMED_TERMS
from fieldcal.noise.prediction import SizeDraw

CHANCES = (0.05, 0.32)
"""Probabilities to be beyond the limit for which a time is stated."""

MAX_INTERVAL_S = 20 * 365.25 * 86400.0
"""Longest time that is stated, s."""

AVERAGED_S = 30.0
"""A of (2), s; the papers use 30 to 60 s."""

MIN_HISTORY = 4
"""Fewest calibrations of the history from which its walk is estimated."""


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
    earlier: Sequence[EarlierBias] = (),
    unseen: float = 0.0,
) -> Recalibration:
    """When a bias leaves its limit, (1), (3).

    Parameters
    ----------
    drawn : draws of the sizes of the processes
    ramp : units per s; used only without history
    limit : largest allowed change
    variance : V, of the calibration
    earlier : by the device's history, at times that increase
    unseen : the largest K that the recording would not show; 0 where it shows one

    """
    seconds = np.geomspace(60.0, MAX_INTERVAL_S, 240)
    known = len(earlier) >= MIN_HISTORY
    walks = walk_from_history(earlier) if known else np.zeros(1)
    mean = 0.0 if known else ramp * seconds
    chance = np.zeros(len(seconds))
    for one in drawn:
        v = variance + _structure(
            one, seconds, 0.0 if known else unseen, own_walk=not known
        )
        root = np.sqrt(v + walks[:, None] * seconds)
        chance += _chance_beyond(limit, mean, root).mean(axis=0) / len(drawn)
    at = np.exp(np.interp(CHANCES, chance, np.log(seconds), right=np.inf))
    times = tuple(float(t) for t in at)
    guessed = not known and unseen > 0 and any("K" not in d.terms for d in drawn)
    first = times[0] if np.isfinite(times[0]) else 0.0
    ramped = not known and abs(ramp) * first > limit / 2
    return Recalibration(limit, times, known, guessed, ramped)


def _structure(one: SizeDraw, seconds: Array, unseen: float, own_walk: bool) -> Array:
    """Variance of the change, (1), without the calibration's own.

    Its `own_walk` counts, or a walk of the size `unseen` if it has none; or neither.
    """
    total = np.zeros(len(seconds))
    times = iter(range(len(one.terms), len(one.x)))
    for i, term in enumerate(one.terms):
        size = float(np.exp(one.x[i]))
        time = float(np.exp(one.x[next(times)])) if term in TIMED_TERMS else np.inf
        if term == "K" and own_walk:
            total += size * seconds
        elif term == "G":
            kept = -np.expm1(-AVERAGED_S / time) * time / AVERAGED_S
            total += -2 * size * kept**2 * np.expm1(-seconds / time)  # (2)
        elif term in ("B", "BT"):
            # of each e-fold of correlation times from A to T, those below t have moved
            moved = np.maximum(np.minimum(seconds, time) / AVERAGED_S, 1.0)
            total += 2 * size / np.pi * np.log(moved)
    if own_walk and "K" not in one.terms:
        total += unseen**2 * seconds
    return total


def _chance_beyond(limit: float, mean: Array | float, root: Array) -> Array:
    from scipy.special import ndtr

    within: Array = ndtr((limit - mean) / root) - ndtr((-limit - mean) / root)
    return 1 - within  # (3)
