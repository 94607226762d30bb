"""Spellings of times with their dates, and what days a date may be.

    Wed Dec 22 21:09:46 2021     20260314T101530.250Z     260314_101530.25
    2026-03-14_10-15-30.250      2026-073T10:15:30        2026年03月14日 10:15:30.25

Each becomes one with the date before the time and signs between all parts.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import date, timedelta

DATE = (
    r"(?P<date>\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4}"
    r"|\d{1,2}[- ][A-Za-z]{3}[- ]\d{4})"
)
"""A date in figures, or with the name of the month between."""

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

_ORDINAL = re.compile(r"((?:19|20)\d\d)[-:/]([0-3]\d\d)[T :_](\d\d:\d\d:\d\d\S*)")
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
    rf"{DATE}[T _-](\d\d)([-.])(\d\d)\3(\d\d)(?:(?:[.,]|\3)(\d+))?(\D.*)?"
)
"""Signs as names of files have them: ``2026-03-14_10-15-30.250``."""

_MONTHS = "jan feb mar apr may jun jul aug sep oct nov dec".split()


def usual_form(text: str) -> str:
    """A time with its date before it, with its signs; another text as it is.

    >>> usual_form("Mon, 05 Jan 2026 11:59:45 GMT"), usual_form("20260314T101530.25Z")
    ('05-Jan-2026 11:59:45 GMT', '2026-03-14T10:15:30.25Z')
    >>> usual_form("260314_101530"), usual_form("2026-073T10:15:30"), usual_form("1.5")
    ('26-03-14T10:15:30', '2026-03-14T10:15:30', '1.5')
    """
    text = text.strip()
    for form, write in _FORMS:
        if (said := form.fullmatch(text)) is not None:
            return write(said)
    return text


def _basic(said: re.Match[str]) -> str:
    year, month, day, hour, minute, second, part, zone = said.groups("")
    part = f".{part.lstrip('.,')}" if part else ""
    return f"{year}-{month}-{day}T{hour}:{minute}:{second}{part}{zone}"


def _dashed(said: re.Match[str]) -> str:
    day, hour, _, minute, second, part, zone = said.groups("")
    return f"{day}T{hour}:{minute}:{second}{'.' if part else ''}{part}{zone}"


def _short_year(said: re.Match[str]) -> str:
    one, two, three, hour, minute, second, part = said.groups("")
    day = f"{one}-{two}-{three}"
    # of 999999 a day there is none: a number
    known = possible_dates(day)
    return f"{day}T{hour}:{minute}:{second}{part}" if known else said[0]


def _ordinal(said: re.Match[str]) -> str:
    year, number, rest = said.groups()
    day = date(int(year), 1, 1) + timedelta(days=int(number) - 1)
    return f"{day}T{rest}"


def _signs(said: re.Match[str]) -> str:
    year, month, day, hour, minute, second = said.groups()
    return f"{year}-{month}-{day}T{hour}:{minute}:{second}"


def _worded(said: re.Match[str]) -> str:
    one, two, year, rest = said.groups()
    month, day = (two, one) if one.isdecimal() else (one, two)
    return f"{day}-{month[:3]}-{year} {rest}"


_FORMS: tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], str]], ...] = (
    (_BASIC, _basic),
    (_PLAIN, _basic),
    (_DASHED, _dashed),
    (_SHORT_YEAR, _short_year),
    (_ORDINAL, _ordinal),
    (_DAY_OF_YEAR, lambda said: f"{said[1]} days {said[2]}"),
    (_SIGNS, _signs),
    (_WORDED, _worded),
    (_LATE_YEAR, lambda x: f"{x['day']}-{x['month']}-{x['year']} {x['time']}"),
)
"""Spellings, and how each is written with signs."""


def possible_dates(written: str) -> list[int]:
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
