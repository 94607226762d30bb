"""Questions about columns that may be read in several ways, with the answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from shlex import quote

from fieldcal.core.samples import Array
from fieldcal.importing.columns import OTHERS, SKIP, has_time
from fieldcal.importing.headings.heading import Heading
from fieldcal.importing.tables.column_physics import likely_columns, possible_columns

MOST = 4
"""Ways that are listed."""


def columns_option(
    channels: Mapping[int, str], places: Sequence[str], skip: str
) -> str:
    """Columns as ``--columns`` names them, those at the end that nobody needs at once.

    Parameters
    ----------
    channels : by number of column
    places : what the option calls each column, where columns have names
    skip : what stands for a column that is not wanted; "" where columns have names

    >>> columns_option({1: "t", 0: "ax"}, [""] * 9, "_"), columns_option({}, ["a"], "")
    ('ax,t,_...', '')
    """
    if not skip:
        return ",".join(f"{channels[i]}={places[i]}" for i in sorted(channels))
    last = max(channels, default=-1)
    named = [channels.get(i, skip) for i in range(last + 1)]
    more = len(places) - len(named)
    return ",".join([*named, *([OTHERS] if more > len("xyz") else [skip] * more)])


def ask_of_choices(table: Array, way: Heading | None) -> str:
    """Ask which of several sensors to take, as far as turns tell them; "" if not.

    A file without names may hold two accelerometers and a gyroscope, or several IMUs.

    Parameters
    ----------
    table : (n, k) of the first rows
    way : what stands over the columns, or nothing

    """
    k = table.shape[1]
    fits = way is not None and len(way.columns) == k
    columns = way.columns if way is not None and fits else []
    names = [column.name for column in columns] or [""] * k
    skip = way.skip if way is not None and fits else SKIP
    places = [column.place for column in columns] or [""] * k
    found = possible_columns(table, names, {})
    if len(found) < len("ab"):
        return _ask_of_rates(likely_columns(table, names, {}), places, skip)
    options = [
        quote(columns_option(one, places, skip)) for one in sorted(found, key=_apart)
    ]
    timed = has_time(found[0].values())
    more = f", or {len(found) - MOST} other ways" if len(found) > MOST else ""
    return (
        "no name says what its columns are, and gravity turns by several of them: they"
        " are of several sensors. Add --columns"
        f" {' or --columns '.join(options[:MOST])}{more}"
        f"{'' if timed else ', and --rate HZ, as no column is a time'}"
    )


def _ask_of_rates(
    ways: Sequence[Mapping[int, str]], places: Sequence[str], skip: str
) -> str:
    """Ask which columns are the rates, where those of the forces are told; "" if not.

    The last of `ways` have forces alone, each those of another device.
    """
    if not ways:
        return ""
    beside = [one for one in ways if "gx" in one.values()]
    alone = ways[len(beside) :]
    options = [
        f"--columns {quote(columns_option(one, places, skip))}"
        for one in (*beside[: MOST - 1], *alone[:MOST])
    ]
    timed = has_time(alone[0].values())
    rates = ", and no turn tells which others are rates" if beside else ""
    several = ": they are of several devices, of which one is read at a time"
    return (
        "no name says what its columns are; three of them are as long as gravity"
        f"{f', and so are others{several}' if len(alone) > 1 else ''}{rates}. Add"
        f" {' or '.join(options)}{' without rates' if beside else ''}"
        f"{'' if timed else ', and --rate HZ, as no column is a time'}"
    )


def _apart(channels: Mapping[int, str]) -> tuple[int, int]:
    """How far the axes of both sensors stand apart, and where the first ones are."""
    at = {channel: i for i, channel in channels.items()}
    return abs(at["gx"] - at["ax"]), at["ax"]
