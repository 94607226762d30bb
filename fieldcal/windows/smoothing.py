"""Outputs that a program smoothed, and what they were before.

    y_n = k y_(n-1) + (1 - k) x_n                                                   (1)
    x_n = (y_n - k y_(n-1)) / (1 - k)                                               (2)

x outputs of the device and y those that were recorded, of sample n; the time constant
is -1 / ln k samples. Held still, x is white noise about a mean, so y is an
autoregressive process of first order about it, and behind a turn it goes from what it
was to that mean by a factor k a sample: one k makes both. A mean that is taken over
m samples of y follows its own noise, which is corrected:

    sum (y_(n-1) - mean) (y_n - k y_(n-1)) = -v / (1 - k) on average                (3)

v variance of what is added in each sample. Rounding behind the filter is white, so the
sample before y_(n-1) stands in for it (an instrumental variable), and k is not made
smaller. White noise behind the filter that is more than rounding is none of a program;
neither is what (2) leaves correlated. Source: M. G. Kendall, Note on bias in the
estimation of autocorrelation, 1954, for (3); O. Reiersol 1941 for the instruments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import fftconvolve

from fieldcal.core.samples import Array, Index, Mask

MIN_SAMPLES = 100
"""Fewest samples of a window that is looked at."""

MOST_SAMPLES = 1 << 16
"""Samples of a window that are looked at: more tell no more."""

SLOWEST_FILTER_SAMPLES = 5.0
"""Least time constant, samples: what a sensor itself filters is quicker, or is held to
be white noise in windows."""

WHITE = 0.1
"""Largest correlation of samples that are no longer smoothed: smoothed samples that are
one time constant apart have 0.37, and sums over N samples -0.5 when N apart."""

SURELY = 5.0
"""Standard errors by which a window differs."""

AWAY = 6.0
"""Standard deviations of a sample by which a device is not yet at rest: once in 1e9."""

LARGE_DECAY = 20.0
"""Least decay that is looked at, steps of the output."""

MIN_DECAY_SAMPLES, MIN_DECAYS = 8, 4
"""Fewest samples of a decay, and fewest decays."""

ROUNDS = 6
"""How often where a rest begins and k are found, each from the other."""


@dataclass(frozen=True, slots=True)
class Smoothing:
    """A low-pass of first order, which a program applied.

    Attributes
    ----------
    kept : k, share of the previous output that is kept in each sample
    sigma : its standard uncertainty

    """

    kept: float
    sigma: float

    @property
    def samples(self) -> float:
        """Time constant, samples."""
        return float(-1 / np.log(self.kept))

    @property
    def samples_sigma(self) -> float:
        """Standard uncertainty of the time constant, samples."""
        return self.sigma * self.samples**2 / self.kept


def find_smoothing(triad: Array, windows: Index, step: Array) -> Smoothing | None:
    """Smoothing of the outputs of one sensor; None if there is none.

    Parameters
    ----------
    triad : (n, 3) recorded outputs
    windows : (p, 2) first and one past the last sample of each window
    step : (3,) step of the grid that the values lie on; 0 where they lie on none

    """
    held = [_longest_part(triad[a : min(b, a + MOST_SAMPLES)]) for a, b in windows]
    held = [y for y in held if len(y) >= MIN_SAMPLES]
    if not held:
        return None
    found = _shown_by_noise(held, step)
    if found is None:
        return _shown_by_decays(held, step)
    for _ in range(ROUNDS):
        rests = [y[_rest_begin(y, found.kept) :] for y in held]
        parts = [_Sums.of(y) for y in rests if len(y) >= MIN_SAMPLES]
        found = _pooled(parts, near=found) or found
    return found


def common_smoothing(
    acc: Smoothing | None, gyr: Smoothing | None
) -> tuple[Smoothing | None, Smoothing | None]:
    """The mean of both, for both, where they differ by no more than chance.

    One program smooths both alike; if it were not alike, one would be late.
    """
    if acc is None or gyr is None:
        return acc, gyr
    if abs(acc.kept - gyr.kept) > SURELY * np.hypot(acc.sigma, gyr.sigma):
        return acc, gyr
    weight = np.array([acc.sigma**-2, gyr.sigma**-2])
    kept = float(weight @ [acc.kept, gyr.kept] / weight.sum())
    both = Smoothing(kept, float(weight.sum() ** -0.5))
    return both, both


def _shown_by_noise(held: Sequence[Array], step: Array) -> Smoothing | None:
    """Smoothing by the noise at rest, of outputs that are rounded at random."""
    late = [y[len(y) // 3 :] for y in held]
    moved = np.median([_rounded_at_random(y, step) for y in late], axis=0) > 0
    if not moved.any():
        return None
    still = [_Sums.of(y[:, moved]) for y in late]
    found = _pooled(still)
    return found if found and _is_program(still, found, step[moved]) else None


def _rounded_at_random(y: Array, step: Array) -> Mask:
    """Whether neighbours differ by as much as random rounding makes, each output.

    Where noise does not move an output from step to step, rounding hides it.
    """
    out: Mask = np.diff(y, axis=0).var(axis=0) > step**2 / 8
    return out


def _shown_by_decays(held: Sequence[Array], step: Array) -> Smoothing | None:
    """Smoothing by the decays behind turns, if most have one time constant.

    Of outputs whose steps hide their noise: what others decay by, their noise tells.
    """
    found = [
        one
        for y in held
        for c in np.flatnonzero(~_rounded_at_random(y[len(y) // 2 :], step))
        if (one := _decay(y[:, c], float(step[c]))) is not None
    ]
    if len(found) < MIN_DECAYS:
        return None
    middle = float(np.median([one.kept for one in found]))
    alike = [o for o in found if abs(o.kept - middle) < SURELY * o.sigma]
    if 2 * len(alike) <= len(found) or not _is_slow(middle):
        return None
    weight = np.array([o.sigma**-2 for o in alike])
    kept = float(weight @ [o.kept for o in alike] / weight.sum())
    return Smoothing(kept, float(weight.sum() ** -0.5))


def _decay(y: Array, step: float) -> Smoothing | None:
    """K by the decay of one output to its value at rest, (n,); None without one.

    Rounding must be all that it leaves, and it must lead to the value at the end.
    """
    off = np.abs(y - y[-1])
    begun, far = off[: len(y) // 3] > off.max() / 2, off > SURELY * step
    if off.max() < LARGE_DECAY * step or not begun.any():
        return None
    first = int(np.flatnonzero(begun)[-1])
    part = y[first : np.flatnonzero(far)[-1] + 1]
    if len(part) < MIN_DECAY_SAMPLES:
        return None
    old, new = part[:-2] - part[:-2].mean(), part[2:] - part[2:].mean()
    middle = part[1:-1] - part[1:-1].mean()
    kept = float(old @ new / (old @ middle))
    if not _is_slow(kept):
        return None
    curve = np.column_stack(
        [kept ** np.arange(len(y) - first), np.ones(len(y) - first)]
    )
    fitted = np.linalg.lstsq(curve[: len(part)], part, rcond=None)[0]
    left: Array = y[first:] - curve @ fitted
    if float(left[: len(part)].std()) > step or abs(left[-1]) > 2 * step:
        return None
    rounding = step * np.sqrt((1 + kept**2) / 12)
    return Smoothing(kept, float(rounding / np.sqrt(middle @ middle)))


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


@dataclass(frozen=True, slots=True)
class _Sums:
    """Products of samples of one window, each sample less their mean; (3,) each.

    Attributes
    ----------
    later, before : of the instrument with y_n and with y_(n-1)
    square : of the instrument with itself
    y : (m, 3) samples

    """

    later: Array
    before: Array
    square: Array
    y: Array

    @classmethod
    def of(cls, y: Array) -> _Sums:
        """Sums of the samples of a window, (m, 3)."""
        oldest, old, new = (
            part - part.mean(axis=0) for part in (y[:-2], y[1:-1], y[2:])
        )
        return cls(
            (oldest * new).sum(axis=0),
            (oldest * old).sum(axis=0),
            (oldest**2).sum(axis=0),
            y,
        )

    def added(self, kept: float) -> Array:
        """What is added in each sample, about its mean, (m - 1, 3)."""
        new = self.y[1:] - kept * self.y[:-1]
        out: Array = new - new.mean(axis=0)
        return out


def _longest_part(y: Array) -> Array:
    """Longest part without a missing sample."""
    missing = np.flatnonzero(~np.isfinite(y).all(axis=1))
    if not len(missing):
        return y
    ends = np.concatenate([[-1], missing, [len(y)]])
    at = int(np.argmax(np.diff(ends)))
    return y[ends[at] + 1 : ends[at + 1]]


def _pooled(parts: Sequence[_Sums], near: Smoothing | None = None) -> Smoothing | None:
    """One k of all windows and outputs; None if it is no smoothing.

    Windows that differ from `near` by more than chance are left out: there the device
    does not rest.
    """
    if not parts:
        return None
    later = np.array([p.later for p in parts])
    before = np.array([p.before for p in parts])
    square = np.array([p.square for p in parts])
    kept = near.kept if near else float(later.sum() / max(before.sum(), 1e-300))
    for _ in range(2):
        if not _is_slow(kept):
            return None
        v = np.array([p.added(kept).var(axis=0) for p in parts])
        if not (v > 0).any():
            return None
        weight = np.where(v > 0, 1 / np.where(v > 0, v, 1.0), 0.0)
        right = later + v / (1 - kept)  # (3)
        known = np.where((weight > 0) & (before > 0), 1.0, 0.0)
        if near:
            own = right / np.where(before > 0, before, 1.0)
            apart = v * square / np.where(before > 0, before, 1.0) ** 2
            known *= np.abs(own - kept) < SURELY * np.sqrt(apart + near.sigma**2)
        total = float((weight * before * known).sum())
        if not total:
            return None
        kept = float((weight * right * known).sum() / total)
    sigma = float(np.sqrt((weight * square * known).sum())) / total
    return Smoothing(kept, sigma) if _is_slow(kept) else None


def _is_slow(kept: float) -> bool:
    return 0 < kept < 1 and -1 / np.log(kept) >= SLOWEST_FILTER_SAMPLES


def _is_program(parts: Sequence[_Sums], found: Smoothing, step: Array) -> bool:
    """Whether (2) leaves white noise, and rounding behind it at most."""
    added = [p.added(found.kept) for p in parts]
    count = sum(len(e) for e in added)
    v = np.sum([(e**2).sum(axis=0) for e in added], axis=0) / count
    if not v.all():
        return False
    beside = np.sum([(e[1:] * e[:-1]).sum(axis=0) for e in added], axis=0) / count
    rounding = -beside / found.kept
    allowed = step**2 / 6 + SURELY * v / np.sqrt(count)
    if np.any(rounding > allowed):
        return False
    lags = int(2 * found.samples) + 2
    correlation = np.sum([_products(e / np.sqrt(v), lags) for e in added], axis=0)
    return bool(np.abs(correlation[1:] / count).max() < WHITE)


def _products(e: Array, lags: int) -> Array:
    """Sums of products of samples 1 to `lags` apart, (lags, 3)."""
    e = np.nan_to_num(e)
    both: Array = fftconvolve(e, e[::-1], axes=0)[len(e) :]
    out: Array = np.zeros((lags, e.shape[1]))
    out[: min(lags, len(both))] = both[:lags]
    return out


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
