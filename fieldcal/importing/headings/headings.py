"""Headings of columns that state channels and units, of one IMU or of several.

Taken is only what leaves no choice: each channel of an IMU is there once, and axes come
in threes. A unit that no heading says is left to physics or to the user. Where a log
has several IMUs, what their names do not share tells them apart, and what one alone has
(the time, the only thermometer, the only gyroscopes) belongs to all.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from fieldcal.importing.headings.heading import Column, HeadingMatch
from fieldcal.importing.words.heading_units import UNITS
from fieldcal.importing.words.heading_words import (
    MEAN,
    REFERENCE,
    SCATTER,
    Meaning,
    bare_label,
    meaning,
    words_of,
)

NOT_SAMPLES = (*SCATTER, "min", "max", "median", "bias", "offset", "cov", "filtered",
               "magnitude", "norm", "drift", "delta",
               "covariance")  # fmt: skip
"""Words of columns that are no samples of a sensor."""

FOREIGN = ("baro", "barometer", "bmp", "ms", "pressure", "mag", "ambient", "air",
           "board", "env", "cpu", "case", "gps", "room")  # fmt: skip
"""Words of thermometers that lie apart from the IMU."""

G_FORCE = (("g",), ("g", "force"))
"""Words of ``gFx``: a program that writes it calls ``ax`` what has no gravity in it."""

AXES = ("x", "y", "z")

ROS = (("angular", "velocity"), ("linear", "acceleration"), ("ang", "vel"),
       ("lin", "acc"))  # fmt: skip
"""Words of the axes of ROS's sensor_msgs/Imu, which is defined in rad/s."""

OTHER_CLOCK = ("host", "utc", "gps", "system", "local", "unix", "arrival", "log")
"""Words of times that are another clock's than the device's."""


ANGLES = ("roll", "pitch", "yaw", "heading", "azimuth", "euler", "quat", "quaternion")
"""Words of what a filter computes of an attitude."""


class Named(NamedTuple):
    """A column by its number, and what its name says."""

    number: int
    says: Meaning


def read(
    columns: Sequence[Column], skip: str = "", weak: bool = False
) -> tuple[HeadingMatch, ...]:
    """Channels and units from headings, by IMU; none if they are not those of IMUs.

    Parameters
    ----------
    columns : in the order of the file
    skip : what stands for one that is not wanted; where nothing does, it is left out
    weak : whether accelerations are taken that may lack gravity, with nothing beside

    """
    named = [
        Named(i, said)
        for i, column in enumerate(columns)
        if "," not in column.place
        and (said := meaning(column.name, column.unit)) is not None
        and (said.kind == "t" or not set(said.label) & set(NOT_SAMPLES))
    ]
    named = _in_units(_with_rates(_with_temperature(columns, _measured(named))))
    named = _with_gravity(named)
    acc, gyr = _triads(named, "a"), _triads(named, "g")
    if acc is None or gyr is None:
        return ()
    if not (acc or gyr):
        return _of_a_thermometer(columns, named, skip)
    # without gyroscopes beside it, a "linear acceleration" may lack gravity
    lacking = all(one.says.weak for three in acc.values() for one in three)
    if not gyr and lacking and not weak:
        return ()
    times = _stamps([n for n in named if n.says.kind == "t"])
    steps = [n for n in named if n.says.kind == "dt"][:1]
    apart = [n for n in named if n.says.kind == "l"]
    found = []
    for label in acc or gyr:
        both = [*acc.get(label, ()), *_beside(label, gyr)]
        warm, says = _thermometer(named, label)
        rest = _one([n for n in named if n.says.kind == "seq"], ())
        rest += [n for n in named if n.says.kind == "t_host"][:1]
        clock = _one(_own(times, label) or times, OTHER_CLOCK) or steps
        chosen = [*clock, *both, *apart, *warm, *rest]
        found.append(_match(columns, chosen, skip, "_".join(label) or "0", says))
    if len(found) == 1:
        found = [replace(found[0], name="0")]
    return tuple(found)


def no_axes(columns: Sequence[Column]) -> list[int]:
    """Columns whose names say that they are no axes of an IMU, whatever they hold."""
    found = []
    for i, column in enumerate(columns):
        said, words = meaning(column.name, column.unit), {*words_of(column.name)}
        kind = said.kind if said is not None else ""
        if words & {*SCATTER} or kind == "m" or (words & {*ANGLES} and kind != "g"):
            found.append(i)
    return found


def _of_a_thermometer(
    columns: Sequence[Column], named: Sequence[Named], skip: str
) -> tuple[HeadingMatch, ...]:
    """Columns of times and temperatures alone: a file beside those of the IMU."""
    kinds = [n.says.kind for n in named]
    if sorted(kinds) != ["t", "temperature"] or len(columns) != len(kinds):
        return ()
    return (_match(columns, named, skip, "0", ()),)


def _with_temperature(columns: Sequence[Column], named: Sequence[Named]) -> list[Named]:
    """Columns of which a "T" is the temperature, where another is the time."""
    times = [n for n in named if n.says.kind == "t"]
    warm = [n for n in times if columns[n.number].name.strip() == "T"]
    if not warm or len(times) == len(warm):
        return [*named]
    as_warm = [n._replace(says=Meaning("temperature", "", None)) for n in warm]
    return [n for n in named if n not in warm] + as_warm


def _measured(named: Sequence[Named]) -> list[Named]:
    """Columns without those of what outputs ought to be, where outputs are there."""
    ought = [n for n in named if set(n.says.label) & set(REFERENCE)]
    outputs = {n.says.kind for n in named if n not in ought}
    return [n for n in named if n not in ought or n.says.kind not in outputs]


def _with_rates(named: Sequence[Named]) -> list[Named]:
    """Columns without those of gains of angle, where rates are there."""
    rates = [n for n in named if n.says.kind == "g"]
    gains = [n for n in rates if n.says.weak]
    return [n for n in named if n not in gains or len(gains) == len(rates)]


def _in_units(named: Sequence[Named]) -> list[Named]:
    """Columns without the counts of axes of which the same stands there in units."""
    axes = [n for n in named if n.says.axis and n.says.kind in "ag"]
    in_units = {_axis_of(n) for n in axes if n.says.unit}
    return [
        n for n in named
        if n not in axes or n.says.unit or _axis_of(n) not in in_units
        or "raw" not in n.says.label
    ]  # fmt: skip


def _axis_of(one: Named) -> tuple[str, str, tuple[str, ...]]:
    """Kind, axis and IMU of a column."""
    return one.says.kind, one.says.axis, bare_label(one.says.label)


def _with_gravity(named: Sequence[Named]) -> list[Named]:
    """Columns without those of accelerations that lack gravity, where others have it.

    Where gravity stands in columns of its own, both together are what was measured.
    """
    forces = [n for n in named if n.says.kind == "a"]
    if whole := [n for n in forces if n.says.label in G_FORCE]:
        named = [n for n in named if n in whole or n not in forces]
        forces = whole
    weak = [n for n in forces if n.says.weak]
    gravity = [n for n in named if n.says.kind == "v"]
    others = [n for n in named if n not in weak and n not in gravity]
    if len(weak) < len(forces):
        return others
    axes = [sorted(n.says.axis for n in three) for three in (weak, gravity)]
    if axes != [[*AXES]] * 2 or weak[0].says.unit != gravity[0].says.unit:
        return others + weak
    both = ((gravity, "a"), (weak, "l"))
    parts = [Named(n.number, n.says._replace(kind=kind, label=(), weak=False))
             for three, kind in both for n in three]  # fmt: skip
    return others + parts


def _triads(
    named: Iterable[Named], kind: str
) -> dict[tuple[str, ...], list[Named]] | None:
    """Axes of a kind by what their names do not share; None where that leaves a choice.

    Axes that are not whole are none where others are; nor are those in several units.
    """
    groups: dict[tuple[str, ...], list[Named]] = {}
    for one in named:
        if one.says.kind == kind:
            label = tuple(w for w in bare_label(one.says.label) if w not in MEAN)
            groups.setdefault(label, []).append(one)
    whole = {label: three for label, three in groups.items() if len(three) == len(AXES)}
    if all(
        len({n.says.axis for n in three}) == len(three) for three in groups.values()
    ):
        groups = whole or groups
    for three in groups.values():
        if sorted(one.says.axis for one in three) != [*AXES]:
            return None
        if len({one.says.unit for one in three}) > 1:
            return None
    return groups


def _beside(
    label: tuple[str, ...], gyr: Mapping[tuple[str, ...], list[Named]]
) -> list[Named]:
    """Gyroscopes of an IMU: those with its label, or the only ones there are."""
    return gyr.get(label) or (next(iter(gyr.values())) if len(gyr) == 1 else [])


def _own(named: Iterable[Named], label: tuple[str, ...]) -> list[Named]:
    """Columns whose names say that they are those of one of several IMUs."""
    return [n for n in named if label and set(label) <= set(n.says.label)]


def _one(named: Sequence[Named], but: Sequence[str]) -> list[Named]:
    """One of several of a kind: the plainest name, with no word of `but` if can be."""
    return sorted(
        named, key=lambda n: (bool(set(n.says.label) & set(but)), len(n.says.label))
    )[:1]


def _stamps(times: Sequence[Named]) -> list[Named]:
    """Times at which messages were measured, where those of their arrival are there."""
    whole = [n for n in times if n.says.unit is None and "header" in n.says.label]
    return whole or [*times]


def _thermometer(
    named: Iterable[Named], label: tuple[str, ...]
) -> tuple[list[Named], tuple[str, ...]]:
    """Return the thermometer nearest to an IMU, and what must be said of it."""
    warm = [n for n in named if n.says.kind == "temperature"]
    near = _own(warm, label) or [
        n for n in warm if not set(n.says.label) & set(FOREIGN)
    ]
    if near or not warm:
        return _one(near, ()), ()
    chosen = _one(warm, ())
    other = " ".join(chosen[0].says.label)
    return chosen, (
        f"its only thermometer is that of the {other}: it is taken, but lies apart from"
        " the IMU, so what goes with temperature may lag",
    )


def _match(
    columns: Sequence[Column],
    chosen: Sequence[Named],
    skip: str,
    name: str,
    says: tuple[str, ...],
) -> HeadingMatch:
    """What is taken of the columns for one IMU."""
    kinds = {n.number: n.says for n in chosen}
    found: list[str] = []
    units: dict[str, str | None] = {}
    for i, column in enumerate(columns):
        said = kinds.get(i)
        if said is None:
            found += [skip] if skip else []
            continue
        channel = said.kind + said.axis
        found.append(f"{channel}={column.place}" if column.place else channel)
        if UNITS[said.kind]:
            units["t" if said.kind == "dt" else said.kind] = said.unit
    axes = [words_of(columns[n.number].name) for n in chosen if n.says.axis]
    ros = all(any({*part} <= {*words} for part in ROS) for words in axes)
    return HeadingMatch(tuple(found), units, name, says, "rad/s" if ros else "")
