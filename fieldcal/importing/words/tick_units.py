"""Units of times that are a multiple of one, as timers count: 10 us, 0.1 ms, 1/32768 s.

A timer counts what its clock divides, so no list of such units is whole.
"""

from __future__ import annotations

import re

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Seconds in one of each unit that a timer counts a part or a multiple of."""

_WRITTEN = {"µs": "us", "μs": "us"}
_TICK = re.compile(r"(\d+(?:\.\d+)?|\.\d+|1/\d+) ?(s|ms|us|µs|μs|ns)")


def parse_tick(text: str) -> str | None:
    """Parse a text as so many of a unit of time; None if it is none.

    >>> [parse_tick(text) for text in ("0.1 ms", "1/32768 s", "10µs", "ms", "0 ms")]
    ['0.1ms', '1/32768s', '10us', None, None]
    """
    said = _TICK.fullmatch(text.strip())
    if said is None or not _number(said[1]):
        return None
    return f"{said[1]}{_WRITTEN.get(said[2], said[2])}"


def tick_seconds(unit: str) -> float | None:
    """Seconds in one of a unit that `parse_tick` knows; None of others.

    >>> tick_seconds("31.25us"), tick_seconds("1/1000s"), tick_seconds("min")
    (3.125e-05, 0.001, None)
    """
    said = _TICK.fullmatch(parse_tick(unit) or "")
    return _number(said[1]) * SECONDS[said[2]] if said is not None else None


def _number(text: str) -> float:
    """A number that may be written as a part of one; 0 of a part of nothing."""
    if not text.startswith("1/"):
        return float(text)
    parts = int(text[2:])
    return 1 / parts if parts else 0.0
