"""Times that a text writes as a clock does: ``2024-05-03T23:59:50.123Z``, ``23:59:50``.

The date may lack its signs, as in the basic format: ``20240503T235950.123Z``.
Dates may stand before the time of day, in any usual order, or in a column of their own;
AM and PM, decimal commas and zones are understood, and spreadsheets' ``59:50.1``
(minutes and seconds) as well. Times count in seconds from the first midnight, or the
first hour, by the clock of the first one's zone. Which of 03/05 is the month matters
only where the date changes: the reading that lies nearest to the date before is taken.
"""

from __future__ import annotations

import re

from fieldcal.importing.times.clock_spellings import (
    DATE,
    possible_dates,
    usual_form,
)

_TIME = (
    r"(?P<h>\d{1,2}):(?P<m>\d{2}):(?P<s>\d{2}(?:[.,:]\d+)?)"
    r"(?:\s*(?P<half>[AaPp][Mm]))?"
)
_ZONE = r"(?:\s*(?P<zone>Z|UTC|GMT|[+-]\d\d(?::?\d\d)?))?"
_CLOCK = re.compile(rf"(?:(?:{DATE}|(?P<days>\d+) days?)[T ,;\t_-]\s*)?{_TIME}{_ZONE}")
_MINUTES = re.compile(r"(?P<m>\d{1,2}):(?P<s>\d{2}[.,]\d+)")
_DAY = re.compile(DATE)
_ZONE_BEFORE_NUMBERS = (
    r"(?:\s*(?:Z|UTC|GMT)|[+-]\d\d(?::?\d\d)?|\s*[+-](?:\d\d:\d\d|0\d\d\d))?"
)
"""Behind a space, ``-1234`` is the number of the next column."""

IN_LINE = re.compile(rf"{DATE}[T ]\s*{_TIME}{_ZONE_BEFORE_NUMBERS}(?=\s|$)")
"""A date and time between columns that spaces part."""

DAY, HOUR = 86400.0, 3600.0

AT_ONCE_S = 10.0
"""Between the last row before a clock goes back and the first one behind, s."""


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day, with a date or without.

    >>> [is_clock(c) for c in ("23:59:50.123", "05/03/2024 11:59 PM", "1.5", "59:50.1")]
    [True, False, False, True]
    """
    return bool(_read(cell) or _MINUTES.fullmatch(cell.strip()))


def _read(text: str) -> re.Match[str] | None:
    """Parts of a time, however it is spelt; None of another text."""
    text = text.strip()
    return _CLOCK.fullmatch(text) or _CLOCK.fullmatch(usual_form(text))


def is_date(cell: str) -> bool:
    """Whether a cell is a date alone."""
    return _DAY.fullmatch(cell.strip()) is not None


def possible_days(text: str, day: str = "") -> tuple[int, ...]:
    """Days, counted from the year 1, that a time with its date may be of; () of none.

    Parameters
    ----------
    text : with or without a date
    day : the date, where it has a column of its own

    >>> possible_days("2024-05-03 23:59:50"), possible_days("23:59:50")
    ((739009,), ())
    """
    said = _read(text)
    written = (said["date"] if said else "") or day.strip()
    return tuple(possible_dates(written)) if is_date(written) else ()


class ClockText:
    """Reads the times of one column, in the order of the file.

    >>> clock = ClockText()
    >>> [clock.seconds(text) for text in ("23:59:59.5", "00:00:00.25", "no time")]
    [86399.5, 86400.25, None]
    """

    def __init__(self) -> None:
        self._days: dict[str, int] = {}
        self._first: int | None = None
        self._day, self._last = 0, 0.0
        self._newest, self._later, self._half_days = float("nan"), 0.0, False
        self._zone: float | None = None

    def seconds(self, text: str, day: str = "") -> float | None:
        """Seconds since the first midnight; None of what is no time.

        Parameters
        ----------
        text : with or without a date
        day : the date, where it has a column of its own

        """
        said = _read(text)
        if said is None:
            return self._of_minutes(text)
        h, half = int(said["h"]), (said["half"] or "").lower()
        if half:
            h = h % 12 + (12 if half == "pm" else 0)
        s = float(re.sub("[,:]", ".", said["s"]))
        since = HOUR * h + 60.0 * int(said["m"]) + s - self._set_forward(said["zone"])
        if said["days"]:
            return DAY * int(said["days"]) + since
        if written := said["date"] or day.strip():
            since += DAY * self._number(written)
        else:
            since = self._unwrapped(since, DAY)
        stated = bool(half or said["zone"])
        return since if stated else self._forward(since)

    def _forward(self, since: float) -> float:
        """A time by a clock that goes back by half a day, or an hour in autumn.

        Of 12 hours without AM and PM: 1:00 comes behind 12:59. Where summer ends, the
        clock of the place goes back by an hour when an hour is full.
        """
        back = self._newest - (since + self._later)
        hour = abs(since % HOUR - HOUR / 2) > HOUR / 2 - AT_ONCE_S
        if self._half_days or abs(back - DAY / 2) <= AT_ONCE_S:
            self._half_days = True
            self._later += DAY / 2 * round(back / (DAY / 2))
        elif hour and abs(back - HOUR) <= AT_ONCE_S:
            self._later += HOUR
        self._newest = since + self._later
        return self._newest

    def _set_forward(self, zone: str | None) -> float:
        """By how much a clock is set forward since the first time, s: in summer."""
        if zone is None:
            return 0.0
        east = _east_of_greenwich(zone)
        self._zone = east if self._zone is None else self._zone
        return east - self._zone

    def _of_minutes(self, text: str) -> float | None:
        said = _MINUTES.fullmatch(text.strip())
        if said is None:
            return None
        s = float(said["s"].replace(",", "."))
        return self._unwrapped(60.0 * int(said["m"]) + s, HOUR)

    def _unwrapped(self, since: float, period: float) -> float:
        """A time that begins again with each period."""
        if since < self._last - period / 2:
            self._day += 1
        self._last = since
        return period * self._day + since

    def _number(self, written: str) -> int:
        """Days since the first date."""
        if written not in self._days:
            read = possible_dates(written)
            if self._first is None:
                # the reading that stands, should the date change
                self._days[written], self._first = 0, (read or [0])[0]
                self._read = read or [0]
            else:
                steps = [b - a for a in self._read for b in read] or [0]
                later = [n for n in steps if n >= 0] or steps
                self._days[written] = min(later, key=abs)
        return self._days[written]


def _east_of_greenwich(zone: str) -> float:
    """By how much the clocks of a zone are ahead of UTC, s.

    >>> [_east_of_greenwich(zone) for zone in ("Z", "+05:30", "-07")]
    [0.0, 19800.0, -25200.0]
    """
    digits = re.sub(r"\D", "", zone).ljust(4, "0")
    east = HOUR * int(digits[:2]) + 60.0 * int(digits[2:])
    return -east if zone.startswith("-") else east
