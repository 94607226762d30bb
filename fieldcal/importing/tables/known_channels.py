"""Which channels of a table the names of its columns identify."""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.importing import columns
from fieldcal.importing.headings.heading import Heading, HeadingMatch


def match_quality(found: Sequence[HeadingMatch]) -> tuple[int, int]:
    """Number of channels that are named, and of kinds whose unit is known."""
    named = sum(len([c for c in one.columns if c != columns.SKIP]) for one in found)
    return named, sum(bool(unit) for one in found for unit in one.units.values())


def is_complete(named: Sequence[HeadingMatch]) -> bool:
    """Whether names identify specific force, rate and time."""
    if not named:
        return False
    known = named_channels(named[0])
    return {"ax", "gx"} <= known and columns.has_time(known)


def named_channels(named: HeadingMatch) -> set[str]:
    """Channels of an IMU that names identify."""
    return {c.partition("=")[0] for c in named.columns}


def known_columns(named: Sequence[HeadingMatch], way: Heading | None) -> dict[int, str]:
    """Channels that names identify, by number of column."""
    if not named or way is None:
        return {}
    if way.skip:
        pairs = enumerate(named[0].columns)
        return {i: name for i, name in pairs if name != way.skip}
    number = {c.place: i for i, c in enumerate(way.columns)}
    parted = (c.partition("=") for c in named[0].columns)
    return {number[place]: name for name, _, place in parted}
