"""Units of the times of several files of one IMU, each with a clock of its own.

Of a thermometer alone, one reading in some seconds fits no rate of a logger, and ms
would make it a usual one. The times of the IMU, beside which its own lie, tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.read_options import TIME_UNITS
from fieldcal.importing.recording import Recording
from fieldcal.importing.units.time_units import assumed_time_unit

FIRST_ROWS = 1 << 17
"""Rows at the beginning by which units are told."""

UNITS = ("s", "ms", "us", "ns", "min", "d")

AS_FAST = 1.5
"""Times the rate of the IMU that a thermometer is read at most."""


def settle_time_units(parts: Sequence[Recording]) -> list[str]:
    """Determine the time units of several files; return the reasons.

    That of a thermometer alone, which is slow, is determined by the others' times.
    """
    slow = [part for part in parts if _is_thermometer(part)]
    others = [part for part in parts if part not in slow]
    reasons = [_settle_time_unit(part) for part in others]
    for part in slow:
        if others and not (part.wanted.time_unit or part.wanted.rate_hz):
            unit = thermometer_time_unit(_clock(part), _clock(others[0]))
            part.wanted = replace(part.wanted, time_unit=unit)
        reasons.append(_settle_time_unit(part))
    return [why for why in reasons if why]


def _is_thermometer(part: Recording) -> bool:
    """Whether a file of columns has times and temperatures alone."""
    part.streams()
    named = {c.partition("=")[0] for c in part.wanted.columns}
    return "temperature" in named and not named & {"ax", "gx"}


def _clock(part: Recording) -> Array:
    """Times at the beginning of a file by its own clock, in the unit that is known."""
    one = part.alone(part.streams()[0].name)
    one.from_first = False
    return one.first_rows(part.streams()[0].name, FIRST_ROWS).t


def _settle_time_unit(part: Recording) -> str:
    """Determine the time unit of one of several files; return the reason, "" if stated.

    Each has a clock column of its own, while each unit of a sensor stands in one.
    """
    wanted = part.wanted
    if not part.asks_units or wanted.time_unit or wanted.rate_hz:
        return ""
    stream = part.streams()[0].name
    unit, why = assumed_time_unit(
        str(part.path), part.alone(stream).first_rows(stream, FIRST_ROWS).t
    )
    part.wanted = replace(part.wanted, time_unit=unit or "s")
    return why


def thermometer_time_unit(t: Array, imu: Array) -> str:
    """Unit in which the times (n,) of a thermometer lie beside an IMU's (m,), in s.

    The one in which most of the time that either covers is common to both; "" if none.

    >>> imu = np.arange(0.0, 60.0, 0.01)
    >>> thermometer_time_unit(np.arange(0.0, 60.0, 2.0), imu)
    's'
    >>> thermometer_time_unit(np.arange(0.0, 60e3, 2e3), imu)
    'ms'
    """
    t, imu = (x[np.isfinite(x)] for x in (t, imu))
    if len(t) < len("12") or len(imu) < len("12"):
        return ""
    fastest = AS_FAST / max(float(np.median(np.diff(imu))), 1e-9)
    common = {
        unit: _common_share(t * size, imu)
        for unit in UNITS
        if (size := TIME_UNITS[unit]) * float(np.median(np.diff(t))) * fastest >= 1
    }
    best = max(common, key=common.__getitem__, default="")
    return best if best and common[best] > 0 else ""


def _common_share(t: Array, other: Array) -> float:
    """Part of the time covered by either of two clocks that both cover."""
    both = min(t.max(), other.max()) - max(t.min(), other.min())
    either = max(t.max(), other.max()) - min(t.min(), other.min())
    return float(both / either) if both > 0 else 0.0
