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
from datetime import date, timedelta

_DATE = (
    r"(?P<date>\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4}"
    r"|\d{1,2}[- ][A-Za-z]{3}[- ]\d{4})"
)
_TIME = (
    r"(?P<h>\d{1,2}):(?P<m>\d{2}):(?P<s>\d{2}(?:[.,:]\d+)?)"
    r"(?:\s*(?P<half>[AaPp][Mm]))?"
)
_ZONE = r"(?:\s*(?P<zone>Z|UTC|GMT|[+-]\d\d(?::?\d\d)?))?"
_CLOCK = re.compile(rf"(?:(?:{_DATE}|(?P<days>\d+) days?)[T ,;\t_-]\s*)?{_TIME}{_ZONE}")
_LATE_YEAR = re.compile(
    r"(?:[A-Z][a-z]{2} )?(?P<month>[A-Z][a-z]{2})\s+(?P<day>\d{1,2})"
    r" (?P<time>[\d:.]+) (?P<year>\d{4})"
)
"""What C calls ``ctime``: ``Wed Dec 22 21:09:46 2021``."""

_WORDED = re.compile(
    r"(?:[A-Z][a-z]+, )?(\d{1,2}|[A-Z][a-z]{2,8})[ .]+([A-Z][a-z]{2,8}|\d{1,2}),? "
    r"(\d{4}),? (\d{1,2}:\d\d:.*)"
)
"""Dates in words: ``Mon, 05 Jan 2026 11:59:45 GMT`` of RFC 5322, ``January 5 2026``."""

_DIGITS = r"(0[1-9]|1[0-2])([0-2]\d|3[01]){}([01]\d|2[0-3])([0-5]\d)([0-5]\d|60)"
_BASIC = re.compile(rf"(\d{{4}}){_DIGITS.format('[T _-]')}([.,]\d+)?(\D.*)?")
"""Basic format of ISO 8601, which leaves the signs out: ``20260314T101530.250Z``."""

_SHORT_YEAR = re.compile(
    r"(\d\d)(\d\d)(\d\d)[T _-]([01]\d|2[0-3])([0-5]\d)([0-5]\d|60)([.,]\d+)?"
)
"""The same with two digits of the year, before or behind: ``260314_101530.25``."""

_ORDINAL = re.compile(r"(\d{4})[-:/](\d{3})[T :_](\d\d:\d\d:\d\d\S*)")
_DAY_OF_YEAR = re.compile(r"(\d{3}):(\d\d:\d\d:\d\d(?:[.,]\d+)?)")
"""The day of the year, as ISO 8601 writes it, ``2026-073T10:15:30``, and alone, as the
code of IRIG does: ``073:10:15:30.25``."""

_SIGNS = re.compile(
    r"(\d{4})年(\d{1,2})月(\d{1,2})日\s*(\d{1,2})[时時:](\d\d)[分:](\d\d(?:[.,:]\d+)?)秒?"
)
"""Signs of Chinese and Japanese: ``2026年03月14日 10:15:30.25``."""

_PLAIN = re.compile(rf"(20\d\d){_DIGITS.format('')}([.,]\d+|\d{{3}}|\d{{6}})?()")
"""The same without the T, ``20260314101530250``: no count has such figures in all."""

_DASHED = re.compile(
    rf"{_DATE}[T _-](\d\d)([-.])(\d\d)\3(\d\d)(?:(?:[.,]|\3)(\d+))?(\D.*)?"
)
"""Signs as names of files have them: ``2026-03-14_10-15-30.250``."""

_MINUTES = re.compile(r"(?P<m>\d{1,2}):(?P<s>\d{2}[.,]\d+)")
_DAY = re.compile(_DATE)
_ZONE_BEFORE_NUMBERS = (
    r"(?:\s*(?:Z|UTC|GMT)|[+-]\d\d(?::?\d\d)?|\s*[+-](?:\d\d:\d\d|0\d\d\d))?"
)
"""Behind a space, ``-1234`` is the number of the next column."""

IN_LINE = re.compile(rf"{_DATE}[T ]\s*{_TIME}{_ZONE_BEFORE_NUMBERS}(?=\s|$)")
"""A date and time between columns that spaces part."""

_MONTHS = "jan feb mar apr may jun jul aug sep oct nov dec".split()
DAY, HOUR = 86400.0, 3600.0

AT_ONCE_S = 10.0
"""Between the last row before a clock goes back and the first one behind, s."""


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day, with a date or without.

    >>> [is_clock(c) for c in ("23:59:50.123", "05/03/2024 11:59 PM", "1.5", "59:50.1")]
    [True, False, False, True]
    """
    cell = _usual_form(cell)
    return bool(_CLOCK.fullmatch(cell) or _MINUTES.fullmatch(cell))


def is_date(cell: str) -> bool:
    """Whether a cell is a date alone."""
    return _DAY.fullmatch(cell.strip()) is not None


def _usual_form(text: str) -> str:
    """A time with its date before it, where the year stands behind; with its signs."""
    text = text.strip()
    if (basic := _BASIC.fullmatch(text) or _PLAIN.fullmatch(text)) is not None:
        year, month, day, hour, minute, second, part, zone = basic.groups("")
        part = f".{part.lstrip('.,')}" if part else ""
        return f"{year}-{month}-{day}T{hour}:{minute}:{second}{part}{zone}"
    if (dashed := _DASHED.fullmatch(text)) is not None:
        day, hour, _, minute, second, part, zone = dashed.groups("")
        return f"{day}T{hour}:{minute}:{second}{'.' if part else ''}{part}{zone}"
    if (short := _SHORT_YEAR.fullmatch(text)) is not None:
        one, two, three, hour, minute, second, part = short.groups("")
        day = f"{one}-{two}-{three}"
        # of 999999 a day there is none: a number
        known = _possible_dates(day)
        return f"{day}T{hour}:{minute}:{second}{part}" if known else text
    if (ordinal := _ORDINAL.fullmatch(text)) is not None:
        year, number, rest = ordinal.groups()
        first = date(max(int(year), 1), 1, 1)
        return f"{first + timedelta(days=int(number) - 1)}T{rest}"
    if (numbered := _DAY_OF_YEAR.fullmatch(text)) is not None:
        return f"{numbered[1]} days {numbered[2]}"
    if (signs := _SIGNS.fullmatch(text)) is not None:
        year, month, day, hour, minute, second = signs.groups()
        return f"{year}-{month}-{day}T{hour}:{minute}:{second}"
    if (worded := _WORDED.fullmatch(text)) is not None:
        first, second, year, rest = worded.groups()
        month, day = (second, first) if first.isdecimal() else (first, second)
        return f"{day}-{month[:3]}-{year} {rest}"
    said = _LATE_YEAR.fullmatch(text)
    if said is None:
        return text
    return f"{said['day']}-{said['month']}-{said['year']} {said['time']}"


def possible_days(text: str, day: str = "") -> tuple[int, ...]:
    """Days, counted from the year 1, that a time with its date may be of; () of none.

    Parameters
    ----------
    text : with or without a date
    day : the date, where it has a column of its own

    >>> possible_days("2024-05-03 23:59:50"), possible_days("23:59:50")
    ((739009,), ())
    """
    said = _CLOCK.fullmatch(_usual_form(text))
    written = (said["date"] if said else "") or day.strip()
    return tuple(_possible_dates(written)) if is_date(written) else ()


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
        said = _CLOCK.fullmatch(_usual_form(text))
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
            read = _possible_dates(written)
            if self._first is None:
                # the reading that stands, should the date change
                self._days[written], self._first = 0, (read or [0])[0]
                self._read = read or [0]
            else:
                steps = [b - a for a in self._read for b in read] or [0]
                later = [n for n in steps if n >= 0] or steps
                self._days[written] = min(later, key=abs)
        return self._days[written]


def _possible_dates(written: str) -> list[int]:
    """Days of all possible readings of a date."""
    parts = re.split(r"[-/. ]", written)
    if not parts[1].isdecimal():
        month = parts[1].lower()
        if month not in _MONTHS:
            return []
        tries = [(parts[2], str(_MONTHS.index(month) + 1), parts[0])]
    elif len(parts[0]) == len("2024"):
        tries = [(parts[0], parts[1], parts[2])]
    else:
        tries = [(parts[2], parts[0], parts[1]), (parts[2], parts[1], parts[0])]
        if len(parts[2]) == len("24"):
            tries.append((parts[0], parts[1], parts[2]))
    found = []
    for y, m, d in tries:
        try:
            found.append(date(int(y) % 100 + 2000, int(m), int(d)).toordinal())
        except ValueError:
            continue
    return found


def _east_of_greenwich(zone: str) -> float:
    """By how much the clocks of a zone are ahead of UTC, s.

    >>> [_east_of_greenwich(zone) for zone in ("Z", "+05:30", "-07")]
    [0.0, 19800.0, -25200.0]
    """
    digits = re.sub(r"\D", "", zone).ljust(4, "0")
    east = HOUR * int(digits[:2]) + 60.0 * int(digits[2:])
    return -east if zone.startswith("-") else east
