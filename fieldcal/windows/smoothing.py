"""Outputs that a program smoothed, and what they were before.

    y_n = k y_(n-1) + (1 - k) x_n                                                   (1)
    x_n = (y_n - k y_(n-1)) / (1 - k)                                               (2)

x outputs of the device and y those that were recorded, of sample n; the time constant
is -1 / ln k samples. One k makes the noise of y at rest and the decays behind turns
(`autoregression`, `decays`). It is that of a program if (2) leaves what a device sends:
noise that is correlated over a few samples at most, and that has no less of slow parts
than of quick ones. White noise behind the filter can be of rounding alone. Means over N
samples leave what is opposite N samples apart. Source: model of this project.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array, Index, Mask
from fieldcal.windows.autoregression import (
    OWN_SAMPLES,
    SURELY,
    RestSums,
    Share,
    autocovariance,
    share_kept,
)
from fieldcal.windows.decays import rounded_at_random, share_by_decays

MIN_SAMPLES = 100
"""Fewest samples of a window that is looked at."""

MOST_SAMPLES = 1 << 16
"""Samples of a window that are looked at: more tell no more."""

LEAST_TIME = 5.0
"""Least time constant, samples: less is left to the noise of the windows."""

SLOW_PARTS = 0.2
"""Least variance of means of what (2) leaves, times their length, as a share of that of
samples: 1 of white noise, more behind the filter of a sensor, and next to none of a
sensor that was not smoothed."""

MOST_SLOW_PARTS = 2.0
"""The most of them where noise alone tells k: a sensor's slow walk is no filter."""

SLOW_NOISE = 0.2
"""Share of a time constant by which slow parts of sensors' noise lengthen what noise
tells: a standard deviation over the real recordings that were smoothed for a test."""

FAR_APART = 0.3
"""Largest correlation of what (2) leaves beyond the memory of a sensor's filter: a mean
over N samples leaves -0.5 at N, and a filter of second order much of itself."""

LEFT_BESIDE = 0.1
"""Covariance of neighbours, as a share of their variance, that real sensors have of
their own: white noise behind a filter leaves up to half."""

ALIKE = 3.0
"""Standard deviations by which two sensors may differ that one program smooths."""

AWAY = 6.0
"""Standard deviations of a sample by which a device is not yet at rest: once in 1e9."""

ROUNDS = 6
"""How often where a rest begins and k are found, each from the other."""


def find_smoothing(
    six: Array, windows: Index, steps: Array
) -> tuple[Share | None, Share | None]:
    """Smoothing of the accelerometers and of the gyroscopes; None if there is none.

    Parameters
    ----------
    six : (n, 6) recorded outputs
    windows : (p, 2) first and one past the last sample of each window
    steps : (6,) step of the grid that the values lie on; 0 where they lie on none

    """
    ends = [slice(a, min(b, a + MOST_SAMPLES)) for a, b in windows.tolist()]
    rests = [
        [y for part in ends if len(y := _longest_part(six[part, triad])) >= MIN_SAMPLES]
        for triad in (ACC, GYR)
    ]
    acc, gyr = (
        _of_sensor(held, steps[triad])
        for held, triad in zip(rests, (ACC, GYR), strict=True)
    )
    return _common(acc, gyr, rests)


def without_smoothing(outputs: Array, t: Array, kept: float) -> Array:
    """Outputs before they were smoothed, (2), (n, k).

    Where samples are missing, the previous one is as many samples older.

    Parameters
    ----------
    outputs : (n, k) recorded outputs
    t : (n,) s
    kept : share of the previous output that is kept in each sample

    """
    apart = np.diff(t)
    usual = np.median(apart) if len(apart) else 1.0
    share = kept ** np.maximum(np.round(apart / usual), 1.0)[:, None]
    out: Array = outputs.copy()
    out[1:] = (outputs[1:] - share * outputs[:-1]) / (1 - share)  # (2)
    return out


def _longest_part(y: Array) -> Array:
    """Longest part without a missing sample."""
    missing = np.flatnonzero(~np.isfinite(y).all(axis=1))
    if not len(missing):
        return y
    ends = np.concatenate([[-1], missing, [len(y)]])
    at = int(np.argmax(np.diff(ends)))
    return y[ends[at] + 1 : ends[at + 1]]


def _of_sensor(rests: Sequence[Array], step: Array) -> Share | None:
    """Smoothing of one sensor by its own outputs."""
    if not rests:
        return None
    late = [y[len(y) // 3 :] for y in rests]
    moved = np.median([rounded_at_random(y, step) for y in late], axis=0) > 0
    if moved.any():
        still = [RestSums.of(y[:, moved]) for y in late]
        found = share_kept(still)
        if found and _is_slow(found, rests):
            found = _with_decays([y[:, moved] for y in rests], found)
            if _is_program(still, found, step[moved]):
                return found
    found = share_by_decays(rests, step)
    return found if found and _is_slow(found, rests) else None


def _common(
    acc: Share | None, gyr: Share | None, rests: Sequence[Sequence[Array]]
) -> tuple[Share | None, Share | None]:
    """The same for both sensors, where they allow it: one program smooths both alike.

    If it were not alike, one would be late.
    """
    if acc is None or gyr is None:
        one, other = (gyr, rests[0]) if acc is None else (acc, rests[1])
        both = one if one and _slow_parts(other, one) > SLOW_PARTS else None
        return both or acc, both or gyr
    if abs(acc.kept - gyr.kept) < ALIKE * np.hypot(acc.sigma, gyr.sigma):
        weight = np.array([acc.sigma**-2, gyr.sigma**-2])
        kept = float(weight @ [acc.kept, gyr.kept] / weight.sum())
        both = Share(kept, float(weight.sum() ** -0.5))
        return both, both
    better, other = (acc, rests[1]) if acc.sigma < gyr.sigma else (gyr, rests[0])
    if 1 / MOST_SLOW_PARTS < _slow_parts(other, better) < MOST_SLOW_PARTS:
        return better, better
    return acc, gyr


def _slow_parts(rests: Sequence[Array], found: Share) -> float:
    """Variance of means of what (2) leaves of a sensor, by that of samples."""
    late = [RestSums.of(y[len(y) // 3 :]) for y in rests]
    return 1 + 2 * float(_correlation(late, found).sum()) if late else 0.0


def _is_slow(found: Share, rests: Sequence[Array]) -> bool:
    """Whether it is slower than a sensor's noise, and quicker than the longest rest."""
    return LEAST_TIME <= found.samples <= max(len(y) for y in rests)


def _is_program(still: Sequence[RestSums], found: Share, step: Array) -> bool:
    """Whether (2) leaves what a device sends, and rounding behind it at most."""
    added = [rest.added(found.kept) for rest in still]
    single, beside = autocovariance(added, 1)
    if not single.all():
        return False
    chance = SURELY / np.sqrt(sum(len(e) for e in added))
    allowed = step**2 / 6 + (chance + LEFT_BESIDE) * single
    if np.median(-beside / found.kept - allowed) > 0:  # one axis may have its own noise
        return False
    beside = _correlation(still, found)
    slow, far = 1 + 2 * float(beside.sum()), float(np.abs(beside[OWN_SAMPLES:]).max())
    by_noise = found.sigma > SLOW_NOISE * (1 - found.kept)
    most = 1 / SLOW_PARTS if not by_noise else MOST_SLOW_PARTS
    return SLOW_PARTS < slow < most and far < FAR_APART


def _correlation(still: Sequence[RestSums], found: Share) -> Array:
    """Correlation of what is added in samples up to two time constants apart, (lags,).

    It is the mean over outputs. The mean of n samples, which is subtracted, takes 1 / n
    of each.
    """
    added = [rest.added(found.kept) for rest in still]
    beside = autocovariance(added, int(2 * found.samples) + OWN_SAMPLES)
    known = beside[0] > 0
    if not known.any():
        return np.full(len(beside) - 1, -1.0)
    out: Array = (beside[1:, known] / beside[0, known]).mean(axis=1)
    return out + len(added) / sum(len(e) for e in added)


def _with_decays(rests: Sequence[Array], by_noise: Share) -> Share:
    """Share by all samples from which on the device rests, decays among them.

    Where decays add little, it is known as well as noise can tell it.
    """
    found = by_noise
    for _ in range(ROUNDS):
        held = [y[_rest_begin(y, found.kept) :] for y in rests]
        parts = [RestSums.of(y) for y in held if len(y) >= MIN_SAMPLES]
        again = share_kept(parts, near=found) if parts else None
        found = again if again and _is_slow(again, rests) else found
    slow = SLOW_NOISE * (1 - found.kept)
    if found.sigma > by_noise.sigma / 3:
        return replace(found, sigma=float(np.hypot(found.sigma, slow)))
    return found


def _rest_begin(y: Array, kept: float) -> int:
    """First sample of a window from which on the device rests.

    It is a time constant behind the last sample that shows a motion: the end of one is
    slow, and is seen no more before it is over.
    """
    x = (y[1:] - kept * y[:-1]) / (1 - kept)
    late = x[len(x) // 3 :]
    away: Mask = np.abs(x - late.mean(axis=0)) > AWAY * late.std(axis=0)
    early = np.flatnonzero(away[: len(x) // 3].any(axis=1))
    behind = 2 + int(-1 / np.log(kept))
    return int(early[-1]) + behind if len(early) else 0
