"""Events of the link as marks: gaps, restarts, the clock.

A bad link would make a mark for every lost sample, and each mark is forced to the disk.
So losses are joined into one mark for `MARK_EVERY_S` seconds. A gap of `LONG_GAP_S` or
more is marked at once.
"""

from __future__ import annotations

from dataclasses import asdict
from time import monotonic
from typing import Any, Protocol

import numpy as np

from fieldcal.core.samples import Array, Block, Grain
from fieldcal.drivers.driver import Driver

MARK_EVERY_S = 1.0
"""Shortest time between two marks of the link, s of the host's clock."""

LONG_GAP_S = 0.5
"""Gap that is marked at once, s of device time."""

GAP_INTERVALS = 3.0
"""Usual intervals of a device that are no gap."""

CLOCK_EVERY_S = 30.0
"""Time between two marks of the clock, s of the host's clock."""

CHANGING_NOTES = ("rate_hz", "says")
"""Notes of a driver that change from sample to sample."""

COUNTS = ("gaps", "missing", "repeated", "restarts", "bad", "skipped")


class Marker(Protocol):
    """Receives marks."""

    def mark(self, event: str, **what: Any) -> None:
        """Append a mark."""


class MarkedRecorder(Marker, Protocol):
    """Receives samples and marks of an engine."""

    def append(self, block: Block) -> Block:
        """Record samples; returns them as recorded."""


class LinkMarks:
    """Follows the health of a driver and marks what changes.

    Parameters
    ----------
    driver : whose link
    recorder : where the marks go

    """

    def __init__(self, driver: Driver, recorder: Marker) -> None:
        self._driver, self._recorder = driver, recorder
        self._before = self._counts()
        self._last = self._from = self._to = float("nan")
        self._longest = 0.0
        self._steps: Array = np.zeros(0)
        self._marked = -MARK_EVERY_S
        self._clocked = monotonic()
        self._grain = Grain()
        self._facts = self._device_facts()
        self._same, self._sure = driver.read_back.same, float("nan")

    def take(self, block: Block) -> None:
        """Note what happened up to these samples."""
        edges = np.concatenate([[self._last], block.t])
        steps = np.diff(edges)
        if self._driver.read_back.same != self._same:
            # the answer may be older than these samples, but not than those before
            self._same, self._sure = self._driver.read_back.same, self._last
        self._last = float(block.t[-1])
        if self._grain != self._driver.grain:
            self._grain = self._driver.grain
            self._recorder.mark("grain", **asdict(self._grain))
        if self._device_facts() != self._facts:
            self._facts = self._device_facts()
            until = {"until_s": self._sure} if np.isfinite(self._sure) else {}
            self._recorder.mark("device", **self._driver.notes, **until)
        # whoever reads the link may have counted a gap before its samples come here
        if self._counts() == self._before and not self._has_long_gap(steps):
            self._clock()
            return
        if np.isfinite(steps).any():
            widest = int(np.nanargmax(steps))
            if steps[widest] > self._longest:
                self._longest = float(steps[widest])
                self._from, self._to = edges[widest], edges[widest + 1]
        if self._longest >= LONG_GAP_S or monotonic() - self._marked >= MARK_EVERY_S:
            self._mark()

    def _has_long_gap(self, steps: Array) -> bool:
        """Whether time passed that is long, also for a slow device."""
        known, before = steps[np.isfinite(steps)], self._steps
        if len(known) > 1:
            self._steps = known
        longest = float(known.max(initial=0.0))
        if longest < LONG_GAP_S or not len(before):
            return False
        return longest > GAP_INTERVALS * float(np.median(before))

    def end(self) -> None:
        """Mark everything that has not been marked yet."""
        if self._counts() != self._before:
            self._mark()
        self._clock(at_once=True)

    def _device_facts(self) -> dict[str, Any]:
        """Notes of the driver about the device, without those that always change."""
        return {k: v for k, v in self._driver.notes.items() if k not in CHANGING_NOTES}

    def _counts(self) -> dict[str, int]:
        return {name: getattr(self._driver.health, name) for name in COUNTS}

    def _mark(self) -> None:
        now = self._counts()
        more = {k: n - self._before[k] for k, n in now.items() if n != self._before[k]}
        where: dict[str, Any] = {}
        if self._longest:
            where = {"from_s": round(self._from, 6), "to_s": round(self._to, 6)}
        if where and self._driver.health.since_power_on and "restarts" not in more:
            where["restarted"] = False
        self._recorder.mark("link", **where, **more)
        self._before, self._longest, self._marked = now, 0.0, monotonic()

    def _clock(self, at_once: bool = False) -> None:
        clock = self._driver.health.clock
        if clock is None or not clock.real_time:
            return
        if not (at_once or monotonic() - self._clocked >= CLOCK_EVERY_S):
            return
        self._clocked = monotonic()
        self._recorder.mark("clock", **clock._asdict())
