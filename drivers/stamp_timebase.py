"""Timebase from the device's own stamps.

A stamp s_k is the device's time cut to a resolution q, so the true time lies in
[s_k, s_k + q). With the mean interval T so far, updated at times, and k counted from
the last update,

    t_k = u + k T,  u = min(max(u, s_k - k T), s_k + q - k T)               (1)

is within q of the truth, and as even as the stamps allow; for q = 0 it is the stamp. A
counter is unwrapped first: a span is added where it falls by more than half of it. If
that contradicts the time that passed on the host, at the device's rate so far, as many
spans are added as that time tells. A clock of the time of day falls by a day at
midnight, which is added likewise. A clock that falls by more than `RESTART_BACKWARD`
without such a wrap, or leaps by more than `RESTART_FORWARD` and by more than passed on
the host, was restarted: time goes on from the last sample by the time that passed on
the host.

All in s. Symbols: k sample number, T period, q resolution, u phase.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.drivers.driver import LinkHealth

RESTART_BACKWARD = 1.0
"""Step back of the stamps beyond which the clock has restarted, s."""

RESTART_FORWARD = 60.0
"""Step forward of the stamps beyond which the host's time is compared, s."""

LEAST_HOST_SHARE = 0.005
"""Least share of that step that must pass on the host while the device's rate is not
known: devices run up to 200 x fast."""

LEAST_RATE_TIME = 3.0
"""Time on the host from which the device's rate against the host is known, s."""

LATEST_ARRIVAL = 2.0
"""Usual differences between arrivals, s of the host."""

RATE_ERROR = 0.1
"""Usual error of the rate of a device's time against the host's."""

DAY = 86400.0
"""Time after which a clock of the time of day begins again, s."""

LEAST_SPAN = 3600.0
"""Time in which a counter wraps, s, from which on it is seldom that a restart looks as
if the counter had wrapped."""

LONGEST_POWERED = 1e8
"""Longest time that a device has been on, s. Larger stamps are those of a calendar."""

FIRST_INTERVALS = 16
"""Intervals from which the period is first estimated."""

RENEWAL_SAMPLES = 1024
"""Most samples after which the period is estimated again."""

CREEP_SHARE = 0.01
"""Share of the resolution by which times increase where samples share a stamp."""

_NAN, _INF = float("nan"), float("inf")


class StampTimebase:
    """Times from the device's own stamps, (1).

    Parameters
    ----------
    health : where gaps, missing and repeated samples and restarts are counted
    resolution : of the stamps, s
    span : time after which the counter wraps, s
    since_power_on : whether the stamps count from when the device was switched on; not
        where they are as large as those of a calendar

    """

    def __init__(
        self,
        health: LinkHealth,
        resolution: float = 0.0,
        span: float = float("inf"),
        *,
        since_power_on: bool = False,
    ) -> None:
        self._health = health
        self._since_power_on = since_power_on and span >= LEAST_SPAN
        self._resolution, self._span = resolution, span
        self._offset = 0.0
        self._t = self._stamp = self._host = self._period = _NAN
        self._first, self._count = 0.0, 0
        self._first_host = _NAN
        self._early: list[float] = []
        self._phase, self._k0, self._renewal = _NAN, 0, FIRST_INTERVALS

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times (n,), nan for a sample to drop; `stamps` nan where unknown."""
        parts: list[Array] = [np.empty(0)]
        i = 0
        while i < len(stamps):
            quiet = self._glide(stamps[i : i + RENEWAL_SAMPLES])
            if len(quiet):
                i += len(quiet)
                self._stamp, self._host = float(stamps[i - 1]), float(t_host[i - 1])
                parts.append(quiet)
                continue
            few = slice(i, i + FIRST_INTERVALS)
            pairs = zip(stamps[few].tolist(), t_host[few].tolist(), strict=True)
            parts.append(np.array([self._step(stamp, host) for stamp, host in pairs]))
            i += FIRST_INTERVALS
        return np.concatenate(parts)

    def coarsen(self, resolution: float) -> None:
        """Take the stamps for cut to a resolution, s, from now on."""
        self._resolution = resolution
        if self._t == self._t:
            self._anchor()

    def link_broken(self) -> None:
        """Do nothing: the stamps show the gap."""

    def _glide(self, stamps: Array) -> Array:
        """Times of the first stamps up to the first irregular one, all at once."""
        if self._count < FIRST_INTERVALS:
            return stamps[:0]
        stamps = stamps[: self._renewal - self._count]
        d = np.empty(len(stamps))
        d[:1], d[1:] = stamps[:1] - self._stamp, stamps[1:] - stamps[:-1]
        least = 0.0 if self._coarse else 1e-12
        odd = np.flatnonzero(~((d >= least) & (d < 1.5 * self._period)))
        s = stamps[: odd[0] if len(odd) else len(stamps)] + self._offset
        if not len(s):
            return s
        t, phase = self._even(s) if self._resolution else (s, self._phase)
        if not (t[0] > self._t and np.all(t[1:] > t[:-1])):
            return s[:0]
        self._phase, self._t = phase, float(t[-1])
        self._count += len(t)
        self._renew()
        return t

    def _even(self, s: Array) -> tuple[Array, float]:
        """Return times of coarse stamps, and the phase at the last, (1)."""
        q, phase, i = self._resolution, self._phase, 0
        k = self._count + 1 - self._k0 + np.arange(len(s))
        low = s - k * self._period
        phases = np.empty(len(s))
        while i < len(s):
            out = np.flatnonzero((phase < low[i:]) | (phase > low[i:] + q))
            stop = i + int(out[0]) if len(out) else len(s)
            phases[i:stop] = phase
            if stop < len(s):
                phase = float(min(max(phase, low[stop]), low[stop] + q))
                phases[stop] = phase
            i = stop + 1
        return phases + k * self._period, phase

    @property
    def _coarse(self) -> bool:
        """Whether several samples may share a stamp."""
        return self._resolution > 0 and not self._period > 2 * self._resolution

    def _step(self, stamp: float, host: float) -> float:
        if stamp != stamp:
            k = self._count + 1 - self._k0
            return self._advance(self._later(self._phase + k * self._period))
        if self._t != self._t:
            self._begin(stamp, host)
            return self._t
        if wraps := self._wraps(stamp, host):
            self._offset += wraps * self._span
        elif self._passed_midnight(stamp, host):
            self._offset += DAY
        s = stamp + self._offset
        if self._restarted(s, host):
            return self._restart(stamp, host)
        late = 4 * self._resolution if self._coarse else self._resolution
        if s + late <= self._t or (stamp == self._stamp and not self._coarse):
            self._health.repeated += 1
            return _NAN
        self._stamp, self._host = stamp, host
        return self._advance(self._place(s))

    def _begin(self, stamp: float, host: float) -> None:
        self._t = self._first = stamp + self._offset
        self._count, self._renewal, self._early = 0, FIRST_INTERVALS, []
        self._stamp, self._host = stamp, host
        self._first_host = host
        self._health.since_power_on = self._since_power_on and stamp < LONGEST_POWERED
        self._anchor()

    def _passed(self, host: float) -> tuple[float, float]:
        """Device time since the last sample by the host, and its error; nan if unknown.

        A device that is simulated may run faster than the host's clock.
        """
        seen = self._host - self._first_host
        if not seen >= LEAST_RATE_TIME:
            return _NAN, _NAN
        rate = (self._t - self._first) / seen
        passed = rate * (host - self._host)
        return passed, rate * LATEST_ARRIVAL + RATE_ERROR * abs(passed)

    def _wraps(self, stamp: float, host: float) -> int:
        """How many times the counter wrapped since the last sample."""
        if self._span == _INF:
            return 0
        moved, (passed, error) = stamp - self._stamp, self._passed(host)
        fewest = int(moved < -self._span / 2)
        # a span may be shorter than what is usual between arrivals
        if passed != passed or abs(moved + fewest * self._span - passed) <= error:
            return fewest
        wraps = max(round((passed - moved) / self._span), int(moved < 0))
        told = moved + wraps * self._span
        if moved < 0:  # samples that waited in a buffer come after less time
            return wraps if told <= passed + error else 0
        return wraps if abs(told - passed) <= error else 0

    def _passed_midnight(self, stamp: float, host: float) -> bool:
        """Whether the stamps fell by a day, less the time that passed on the host."""
        passed, error = self._passed(host)
        if passed != passed:
            passed, error = host - self._host, LATEST_ARRIVAL
        told = stamp + DAY - self._stamp
        return told > 0 and abs(told - passed) <= error

    def _place(self, s: float) -> float:
        """Time of a sample stamped `s`, (1)."""
        q, k = self._resolution, self._count + 1 - self._k0
        if not q or self._period != self._period:
            return self._later(s)
        low = s - k * self._period
        self._phase = min(max(self._phase, low), low + q)
        return self._later(self._phase + k * self._period)

    def _later(self, t: float) -> float:
        """Return `t`, but at least a little more than the last time."""
        return t if not t <= self._t else self._t + CREEP_SHARE * self._resolution

    def _advance(self, t: float) -> float:
        if t != t:
            return t
        d, self._t = t - self._t, t
        self._count += 1
        if self._count <= FIRST_INTERVALS:
            self._learn(d)
        elif d > 1.5 * self._period + self._resolution:
            lost = round(d / self._period) - 1
            self._health.gaps += 1
            self._health.missing += lost
            self._count += lost
            self._anchor()
        self._renew()
        return t

    def _learn(self, d: float) -> None:
        """Estimate the period from one of the first intervals and those before."""
        self._early.append(d)
        self._period = float(np.median(self._early))
        # most samples share their stamp with others: only the mean is their period
        shared = self._period < self._resolution / 2
        if shared:
            self._period = float(np.mean(self._early))
        self._anchor()
        if self._count == FIRST_INTERVALS and not shared:
            self._count = sum(max(1, round(d / self._period)) for d in self._early)
            self._renewal = self._count

    def _renew(self) -> None:
        """Estimate the period again when it is due."""
        if self._count >= max(FIRST_INTERVALS, self._renewal):
            self._period = (self._t - self._first) / self._count
            self._renewal = self._count + min(self._count, RENEWAL_SAMPLES)
            self._anchor()

    def _anchor(self) -> None:
        self._phase, self._k0 = self._t, self._count

    def _restarted(self, s: float, host: float) -> bool:
        leap, (passed, error) = s - self._t, self._passed(host)
        witnessed = not host - self._host < LEAST_HOST_SHARE * leap
        if passed == passed:
            witnessed = leap <= passed + error
        return leap < -RESTART_BACKWARD or (leap > RESTART_FORWARD and not witnessed)

    def _restart(self, stamp: float, host: float) -> float:
        self._health.restarts += 1
        self._health.gaps += 1
        known = [d for d in (host - self._host, self._period) if d == d and d > 0]
        self._offset = self._t + max(known, default=1e-3) - stamp
        self._begin(stamp, host)
        return self._t
