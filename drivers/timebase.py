"""The time of each sample: from the device's stamps, its rate, or else its arrivals.

Stamps (`Stamps`). A stamp s_k is the device's time cut to a resolution q, so the true
time lies in [s_k, s_k + q). With T the mean interval so far,

    t_k = min(max(t_(k-1) + T, s_k), s_k + q)                               (1)

is within q of the truth, and as even as the stamps allow; for q = 0 it is the stamp. A
counter is unwrapped first: where it falls by more than half its span, a span is added.
A clock that falls by more than `BACK`, or leaps by more than `LEAP` where the host saw
hardly any time go by, has begun anew: time goes on from the last sample by what the
host saw.

Rate (`Rate`). t_k = k / rate, k counting also the samples known to be missing.     (2)

All in s. Symbols: k sample number, T period, q resolution. `Arrivals` is beside this,
and `Clock` chooses.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from fieldcal.driver import Health
from fieldcal.samples import Array

BACK = 1.0
"""A stamp older by more than this is no late sample but a clock begun anew, s."""

LEAP = 60.0
"""A leap forward by more than this needs the host as a witness, s."""

WITNESS = 0.005
"""Least share of a leap that the host must have seen: devices run up to 200 x fast."""

EARLY = 16
"""Intervals from which the period is first told."""

PIECE = 4096
"""Samples placed at once: a bound to what is looked at in vain."""

_NAN = float("nan")


class Timebase(Protocol):
    """Gives each sample its time."""

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times in s, (n,), nan for a sample to drop.

        Parameters
        ----------
        stamps : (n,) s, the device's own, nan where unknown
        steps : (n,) periods since the sample before
        t_host : (n,) s

        """

    def broken(self) -> None:
        """Take note that the link was away before the next sample."""


class Rate:
    """Times from a declared rate, (2).

    Parameters
    ----------
    health : where gaps and missing samples are counted
    rate : Hz

    """

    def __init__(self, health: Health, rate: float) -> None:
        self._health, self._period = health, 1.0 / rate
        self._base, self._k = 0.0, -1
        self._host = _NAN
        self._broken = False

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times (n,); over a broken link time goes on as the host saw it."""
        if self._broken:
            self._mend(float(t_host[0]))
        k = self._k + np.cumsum(steps)
        self._health.gaps += int(np.sum(steps > 1))
        self._health.missing += int(np.sum(steps - 1))
        self._k, self._host = int(k[-1]), float(t_host[-1])
        t: Array = self._base + k * self._period  # (2)
        return t

    def broken(self) -> None:
        """Have the next sample begin after a gap."""
        self._broken = self._k >= 0

    def _mend(self, host: float) -> None:
        away = host - self._host
        self._base += self._k * self._period + max(self._period, away or 0.0)
        self._k, self._broken = -1, False
        self._health.gaps += 1


class Stamps:
    """Times from the device's own stamps, (1).

    Parameters
    ----------
    health : where gaps, missing and repeated samples and restarts are counted
    resolution : of the stamps, s
    span : of the counter, s, where it wraps

    """

    def __init__(
        self, health: Health, resolution: float = 0.0, span: float = float("inf")
    ) -> None:
        self._health = health
        self._resolution, self._span = resolution, span
        self._offset = 0.0
        self._t = self._stamp = self._host = self._period = _NAN
        self._first, self._count = 0.0, 0
        self._early: list[float] = []

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times (n,), nan for a sample to drop; `stamps` nan where unknown."""
        parts: list[Array] = [np.empty(0)]
        i = 0
        while i < len(stamps):
            quiet = self._glide(stamps[i : i + PIECE])
            if len(quiet):
                i += len(quiet)
                self._stamp, self._host = float(stamps[i - 1]), float(t_host[i - 1])
                parts.append(quiet)
            few = slice(i, i + EARLY)
            pairs = zip(stamps[few].tolist(), t_host[few].tolist(), strict=True)
            parts.append(np.array([self._step(stamp, host) for stamp, host in pairs]))
            i += EARLY
        return np.concatenate(parts)

    def broken(self) -> None:
        """Do nothing: the stamps show the gap."""

    def _glide(self, stamps: Array) -> Array:
        """Place at once the first stamps, as many as nothing happens among."""
        if self._count < EARLY:
            return stamps[:0]
        d = np.diff(stamps, prepend=self._stamp)
        least = 0.0 if self._coarse else 1e-12
        odd = np.flatnonzero(~((d >= least) & (d < 1.5 * self._period)))
        s = stamps[: odd[0] if len(odd) else len(stamps)] + self._offset
        if self._resolution:
            return self._glide_coarse(s)
        if len(s) and not s[0] > self._t:
            return s[:0]
        if len(s):
            self._count += len(s)
            self._t = float(s[-1])
            self._period = (self._t - self._first) / self._count
        return s

    def _glide_coarse(self, stamps: Array) -> Array:
        q, period = self._resolution, self._period
        t, first, count = self._t, self._first, self._count
        times: list[float] = []
        for s in stamps.tolist():
            last = t
            t += period
            if t < s:
                t = s
            elif t > s + q:  # (1)
                t = s + q
                if t <= last:
                    t = last + 0.01 * q
                    if s + 4 * q <= last or not self._coarse:
                        t = last
                        break
            count += 1
            period = (t - first) / count
            times.append(t)
        self._t, self._count, self._period = t, count, period
        return np.array(times)

    @property
    def _coarse(self) -> bool:
        """Whether several samples may share a stamp."""
        return self._resolution > 0 and not self._period > 2 * self._resolution

    def _step(self, stamp: float, host: float) -> float:
        if stamp != stamp:
            return self._advance(self._t + self._period)
        if self._t != self._t:
            self._begin(stamp, host)
            return self._t
        if stamp < self._stamp - self._span / 2:
            self._offset += self._span
        s = stamp + self._offset
        if self._restarted(s, host):
            return self._restart(stamp, host)
        t = self._place(s, stamp == self._stamp)
        if t == t:
            self._stamp, self._host = stamp, host
        return self._advance(t)

    def _begin(self, stamp: float, host: float) -> None:
        self._t = self._first = stamp + self._offset
        self._count, self._early = 0, []
        self._stamp, self._host = stamp, host

    def _place(self, s: float, same: bool) -> float:
        """Time of a sample stamped `s`, nan if that is an old stamp."""
        q = self._resolution
        late = 4 * q if self._coarse else q
        if s + late <= self._t or (same and not self._coarse):
            self._health.repeated += 1
            return _NAN
        expected = self._t + self._period
        t = min(max(expected, s), s + q) if expected == expected else s  # (1)
        return t if t > self._t else self._t + 0.01 * q

    def _advance(self, t: float) -> float:
        if t != t:
            return t
        d, self._t = t - self._t, t
        if self._count < EARLY:
            self._count += 1
            self._early.append(d)
            self._period = float(np.median(self._early))
            if self._count == EARLY:
                self._count = sum(max(1, round(d / self._period)) for d in self._early)
                self._period = (t - self._first) / self._count
            return t
        steps = 1
        if d > 1.5 * self._period + self._resolution:
            steps = round(d / self._period)
            self._health.gaps += 1
            self._health.missing += steps - 1
        self._count += steps
        self._period = (t - self._first) / self._count
        return t

    def _restarted(self, s: float, host: float) -> bool:
        leap = s - self._t
        witnessed = not host - self._host < WITNESS * leap
        return leap < -BACK or (leap > LEAP and not witnessed)

    def _restart(self, stamp: float, host: float) -> float:
        self._health.restarts += 1
        self._health.gaps += 1
        known = [d for d in (host - self._host, self._period) if d == d and d > 0]
        self._offset = self._t + max(known, default=1e-3) - stamp
        self._begin(stamp, host)
        return self._t
