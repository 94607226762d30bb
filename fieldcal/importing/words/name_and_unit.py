"""Possible splits of the name of a column into a bare name and its unit.

ax [m/s^2]   gyro_x_dps   gyroADC[0] (deg/s)   GyroXRadPerSec   Gyro X (deg/s) left
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fieldcal.importing.words.heading_units import TELLING, parse_unit
from fieldcal.importing.words.sensor_words import AXES

_BRACKETS = re.compile(r"(.*?)\s*[\[({](.*)[\])}]\s*")
_LAST_BRACKETS = re.compile(r"(.*)[(\[]([^()\[\]]*)[)\]]\s*")

_INNER_UNIT = re.compile(r"(.*?)[(\[]([^()\[\]]*)[)\]]\s+(\w[\w ]*)")
"""A unit that stands before the last words: ``Gyro X (deg/s) left``."""

_CAPITAL = re.compile(r"(?<=[A-Za-z0-9])[A-Z]")
_PER = re.compile("Per(?=[A-Z])")

_INDEX = re.compile(r"(.+)(?:\[|\.0)([012])\]?")
_INDEX_IN_UNIT = re.compile(r"(.+)\[([012])\]\s*\((.*)\)")
"""Axes of an array: ``gyro_rad[0]``, ``gyroADC[0] (deg/s)``, or ``gyro_rad.00`` as
PlotJuggler writes it."""

Split = tuple[str, str | None]


def name_unit_splits(name: str, unit: str) -> Iterator[Split]:
    """Possible splits of a text into a name and its unit; None where it says none.

    Parameters
    ----------
    name : of a column
    unit : what the file says of it elsewhere, or nothing

    >>> next(name_unit_splits("ax [g]", "")), next(name_unit_splits("gyr[2]", "deg/s"))
    (('ax', 'g'), ('gyr_z', 'deg/s'))
    """
    if (one := _INDEX_IN_UNIT.fullmatch(name)) is not None:
        yield f"{one.group(1)}_{AXES[int(one.group(2))]}", parse_unit(one.group(3))
        return
    if indexed := _INDEX.fullmatch(name):
        name = f"{indexed.group(1)}_{AXES[int(indexed.group(2))]}"
    elif bracketed := [*_bracketed(name)]:
        yield from bracketed
        return
    yield from _behind_a_sign(name)
    for cut in _CAPITAL.finditer(name):
        # of "GyroXRadPerSec" the end; a letter alone is an axis
        if (said := parse_unit(_PER.sub("/", name[cut.start() :]))) in TELLING:
            yield name[: cut.start()], said
    yield name, parse_unit(unit)


def _bracketed(name: str) -> Iterator[Split]:
    """Splits by brackets at the end, or before the last words."""
    if whole := _BRACKETS.fullmatch(name):
        last = _LAST_BRACKETS.fullmatch(name)
        behind = last is not None and last.group(1).strip() != whole.group(1)
        if last and behind and (unit := parse_unit(last.group(2))):
            # what stands in the brackets before the unit says which sensor it is
            yield last.group(1), unit
        yield whole.group(1), parse_unit(whole.group(2))
    elif (inner := _INNER_UNIT.fullmatch(name)) and parse_unit(inner.group(2)):
        yield f"{inner.group(1)} {inner.group(3)}", parse_unit(inner.group(2))


def _behind_a_sign(name: str) -> Iterator[Split]:
    """Splits by a sign between words, where the axis may stand behind the unit."""
    for cut in re.finditer("[_ .]", name):
        a, b = cut.span()
        axis = re.fullmatch(r"(.*)[_ .]([xyzXYZ])", name[b:])
        within = axis.group(1) if axis else name[b:]
        bare = f"{name[:a]}_{axis.group(2)}" if axis else name[:a]
        if (said := parse_unit(within.replace("_", "/"))) is not None:
            yield bare, said
