"""Units that stand over columns of which the user says what they are."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from shlex import quote

from fieldcal.importing.headings.heading import Column
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.words.heading_units import TEMPERATURES, is_unit_of, parse_unit
from fieldcal.importing.words.heading_words import heading_meaning

KINDS = {"a": ("ax", "ay", "az"), "g": ("gx", "gy", "gz"), "t": ("t",),
         "temperature": ("temperature",)}  # fmt: skip
"""Channels of each kind."""

_BRACKETS = re.compile(r".*[(\[]([^()\[\]]*)[)\]]\s*")
"""A name that ends with what may be its unit."""

_OPTIONS = {"acc_unit": "--acc-unit", "gyr_unit": "--gyr-unit",
            "time_unit": "--time-unit", "temp_unit": "--temp-unit"}  # fmt: skip


def units_over(columns: Sequence[Column], at: Mapping[str, int]) -> dict[str, str]:
    """Unit of each kind of channel, where the names of all its columns say the same.

    Parameters
    ----------
    columns : in the order of the file
    at : number of each channel's column

    >>> names = ("t (ms)", "fx (g)", "fy (g)", "fz (g)", "p (V)")
    >>> at = {"t": 0, "ax": 1, "ay": 2, "az": 3, "gx": 4}
    >>> units_over([Column("", name) for name in names], at)
    {'a': 'g', 't': 'ms'}
    """
    found = {}
    for kind, channels in KINDS.items():
        there = [at[c] for c in channels if at.get(c, len(columns)) < len(columns)]
        said = {_unit(columns[i]) for i in there}
        unit = said.pop() if len(said) == 1 else None
        if unit is not None and is_unit_of(unit, kind):
            found[kind] = unit
    return found


def _unit(column: Column) -> str | None:
    """The unit that a name says, whatever it says beside it."""
    said = heading_meaning(column.name, column.unit)
    if said is not None:
        return said.unit
    split = _BRACKETS.fullmatch(column.name)
    return parse_unit(split[1] if split else column.unit)


def with_units(wanted: ReadOptions, units: Mapping[str, str]) -> ReadOptions:
    """What the user says, with these units where no option says others."""
    given = {"a": wanted.acc_unit or wanted.acc_lsb != 1,
             "g": wanted.gyr_unit or wanted.gyr_lsb != 1,
             "t": wanted.time_unit or wanted.rate_hz,
             "temperature": wanted.temp_unit}  # fmt: skip
    taken = {kind: unit for kind, unit in units.items() if not given[kind]}
    warm = TEMPERATURES.get(taken.get("temperature", ""), "")
    return replace(
        wanted,
        acc_unit=taken.get("a") or wanted.acc_unit,
        gyr_unit=taken.get("g") or wanted.gyr_unit,
        time_unit=taken.get("t") or wanted.time_unit,
        temp_unit=warm or wanted.temp_unit,
        named=wanted.named | (taken.keys() - {"temperature"}),
    )


def unit_options(before: ReadOptions, after: ReadOptions) -> Iterator[str]:
    """Options that say what `after` has of units and `before` has not."""
    for name, option in _OPTIONS.items():
        if getattr(after, name) != getattr(before, name):
            yield f"{option} {quote(getattr(after, name))}"
