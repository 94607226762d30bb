"""Conditions for finding sessions in the store."""

from __future__ import annotations

import re
from collections.abc import Iterable
from datetime import UTC, date, datetime
from typing import Any

from sqlalchemy import or_

from fieldcal.core.errors import InputError
from fieldcal.history.tables import SESSION

LEVELS = ("model", "lot", "station", "operator")
"""Properties that sessions of several devices may share, from session.toml."""

FILTERS = ("serial", *LEVELS, "since", "until")
"""Names of the conditions for finding sessions."""

TIMES = ("since", "until")
"""Those of them that are dates."""

DATE = re.compile(r"(\d{4})(?:-(\d{1,2}))?(?:-(\d{1,2}))?")
"""A date, a month or a year."""


def parse_filters(words: Iterable[str]) -> dict[str, str]:
    """Parse conditions such as ``lot=7``.

    Raises
    ------
    InputError
        If a word is no condition or repeats one, or has no date where one belongs.

    """
    found = {}
    for word in words:
        name, equals, value = word.partition("=")
        if not equals or name not in FILTERS:
            raise InputError(
                f"{word}: is no condition; write one of {', '.join(FILTERS)} and a"
                " value, as in lot=7 or since=2026-03-01"
            )
        if name in found:
            raise InputError(
                f"{word}: {name} is given twice; a session has one, so ask for one at a"
                " time"
            )
        found[name] = _parse_date(word, value) if name in TIMES else value.strip()
    return found


def _parse_date(word: str, value: str) -> str:
    """Text of a date, month, year or time, which compares with `taken_at` as text."""
    parts = DATE.fullmatch(value)
    try:
        if parts is None:
            at = datetime.fromisoformat(value)
            at = at if at.tzinfo else at.replace(tzinfo=UTC)
            return at.astimezone(UTC).isoformat(timespec="seconds")
        numbers = [int(part) for part in parts.groups() if part]
        date(*[*numbers, 1, 1][:3])
    except ValueError as error:
        raise InputError(
            f"{word}: is no date ({error}); write it as in since=2026-03-01"
        ) from error
    return "-".join(f"{number:02d}" for number in numbers)


def condition(name: str, value: str) -> Any:
    """The condition on the table of sessions, for a query."""
    if name == "since":
        return SESSION.c.taken_at >= value
    if name == "until":
        return or_(SESSION.c.taken_at < value, SESSION.c.taken_at.startswith(value))
    return SESSION.c[name] == value
