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
from fieldcal.importing.headings.repeated_names import with_distinct_names
from fieldcal.importing.words.heading_units import UNITS
from fieldcal.importing.words.heading_words import (
    MEAN,
    REFERENCE,
    SCATTER,
    HeadingMeaning,
    bare_axis,
    bare_label,
    heading_meaning,
    words_in_name,
)
from fieldcal.importing.words.telephone_names import sign_of_ios
from fieldcal.importing.words.thermometer_words import BESIDE_THERMOMETERS, FOREIGN

NOT_SAMPLES = (*SCATTER, "min", "max", "median", "bias", "offset", "cov", "filtered",
               "magnitude", "norm", "drift", "delta",
               "covariance", "valid", "validity", "flag", "status")  # fmt: skip
"""Words of columns that are no samples of a sensor."""

G_FORCE = (("g",), ("g", "force"))
"""Words of ``gFx``: a program that writes it calls ``ax`` what has no gravity in it."""

AXES = ("x", "y", "z")

ROS = (("angular", "velocity"), ("linear", "acceleration"), ("ang", "vel"),
       ("lin", "acc"))  # fmt: skip
"""Words of the axes of ROS's sensor_msgs/Imu, which is defined in rad/s."""

OTHER_CLOCK = ("host", "utc", "gps", "system", "local", "unix", "arrival", "arrived",
               "log", "receive", "received", "recv", "reception", "rx",
               "recorded")  # fmt: skip
"""Words of times that are another clock's than the device's."""


ANGLES = ("roll", "pitch", "yaw", "heading", "azimuth", "euler", "quat", "quaternion")
"""Words of what a filter computes of an attitude."""


class NamedColumn(NamedTuple):
    """Number of a column, and the meaning of its name."""

    number: int
    says: HeadingMeaning


def match_headings(
    columns: Sequence[Column], skip: str = "", weak: bool = False
) -> tuple[HeadingMatch, ...]:
    """Match headings to channels and units, by IMU; empty if there is no IMU.

    Parameters
    ----------
    columns : in the order of the file
    skip : what stands for one that is not wanted; where nothing does, it is left out
    weak : whether accelerations are taken that may lack gravity, with nothing beside

    """
    columns = with_distinct_names(columns)
    named = [
        NamedColumn(i, said)
        for i, column in enumerate(columns)
        if "," not in column.place
        and (said := heading_meaning(column.name, column.unit)) is not None
        and (said.kind == "t" or not set(said.label) & set(NOT_SAMPLES))
    ]
    named = _without_counts(
        _without_angle_gains(_with_temperature(columns, _without_references(named)))
    )
    named = _without_linear_acceleration(named)
    acc, gyr = _triads(named, "a"), _triads(named, "g")
    if acc is None or gyr is None:
        return ()
    if not (acc or gyr):
        return _match_thermometer_file(columns, named, skip)
    # without gyroscopes beside it, a "linear acceleration" may lack gravity
    lacking = all(one.says.weak for three in acc.values() for one in three)
    if not gyr and lacking and not weak:
        return ()
    times = _stamps([n for n in named if n.says.kind == "t"])
    steps = [n for n in named if n.says.kind == "dt"][:1]
    apart = [n for n in named if n.says.kind == "l"]
    found = []
    for label in acc or gyr:
        both = [*acc.get(label, ()), *_gyroscopes_of(label, gyr)]
        warm, says = _thermometer(named, label)
        rest = _plainest([n for n in named if n.says.kind == "seq"], ())
        rest += [n for n in named if n.says.kind == "t_host"][:1]
        clock = _plainest(_columns_of_imu(times, label) or times, OTHER_CLOCK) or steps
        chosen = [*clock, *both, *apart, *warm, *rest]
        found.append(_match(columns, chosen, skip, "_".join(label) or "0", says))
    if len(found) == 1:
        found = [replace(found[0], name="0")]
    return tuple(found)


def columns_without_axes(columns: Sequence[Column]) -> list[int]:
    """Columns whose names exclude that they are axes of an IMU."""
    found = []
    for i, column in enumerate(columns):
        said, words = (
            heading_meaning(column.name, column.unit),
            {*words_in_name(column.name)},
        )
        kind = said.kind if said is not None else ""
        if words & {*SCATTER} or kind == "m" or (words & {*ANGLES} and kind != "g"):
            found.append(i)
    return found


def _match_thermometer_file(
    columns: Sequence[Column], named: Sequence[NamedColumn], skip: str
) -> tuple[HeadingMatch, ...]:
    """Match a file of times and temperatures, one of which is clearly the sensor's.

    What else it holds is no axis: it is called otherwise, or is in one or two columns.
    """
    times = [n for n in named if n.says.kind == "t"]
    warm = [n for n in named if n.says.kind == "temperature"]
    near = [n for n in warm if not {*n.says.label} & {*FOREIGN}]
    chosen = near if len(near) == 1 else warm
    others = {*range(len(columns))} - {n.number for n in (*times, *warm)}
    words = [words_in_name(columns[i].name) for i in others]
    unknown = [one for one in words if not {*one} & {*BESIDE_THERMOMETERS}]
    if not times or len(chosen) != 1 or len(unknown) >= len(AXES):
        return ()
    if any(n.says.axis for n in named) or any(map(bare_axis, unknown)):
        return ()
    clock = _plainest(_stamps(times), OTHER_CLOCK)
    _, says = _thermometer(chosen, ()) if others else ([], ())
    return (_match(columns, [*clock, *chosen], skip, "0", says),)


def _with_temperature(
    columns: Sequence[Column], named: Sequence[NamedColumn]
) -> list[NamedColumn]:
    """Columns with "T" taken as temperature if another column is the time."""
    times = [n for n in named if n.says.kind == "t"]
    warm = [n for n in times if columns[n.number].name.strip() == "T"]
    if not warm or len(times) == len(warm):
        return [*named]
    as_warm = [n._replace(says=HeadingMeaning("temperature", "", None)) for n in warm]
    return [n for n in named if n not in warm] + as_warm


def _without_references(named: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Columns without reference values, if there are measured ones."""
    ought = [n for n in named if set(n.says.label) & set(REFERENCE)]
    outputs = {n.says.kind for n in named if n not in ought}
    return [n for n in named if n not in ought or n.says.kind not in outputs]


def _without_angle_gains(named: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Columns without increments of angle, if there are rates."""
    rates = [n for n in named if n.says.kind == "g"]
    gains = [n for n in rates if n.says.weak]
    return [n for n in named if n not in gains or len(gains) == len(rates)]


def _without_counts(named: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Columns without counts of axes that are also given in units."""
    axes = [n for n in named if n.says.axis and n.says.kind in "ag"]
    in_units = {_axis_of(n) for n in axes if n.says.unit}
    return [
        n for n in named
        if n not in axes or n.says.unit or _axis_of(n) not in in_units
        or "raw" not in n.says.label
    ]  # fmt: skip


def _axis_of(one: NamedColumn) -> tuple[str, str, tuple[str, ...]]:
    """Kind, axis and IMU of a column."""
    return one.says.kind, one.says.axis, bare_label(one.says.label)


def _without_linear_acceleration(named: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Columns without accelerations less gravity, if there are specific forces.

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
    parts = [NamedColumn(n.number, n.says._replace(kind=kind, label=(), weak=False))
             for three, kind in both for n in three]  # fmt: skip
    return others + parts


def _triads(
    named: Iterable[NamedColumn], kind: str
) -> dict[tuple[str, ...], list[NamedColumn]] | None:
    """Axes of a kind, by the words in which their names differ; None if ambiguous.

    Axes that are not whole are none where others are; nor are those in several units.
    """
    groups: dict[tuple[str, ...], list[NamedColumn]] = {}
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


def _gyroscopes_of(
    label: tuple[str, ...], gyr: Mapping[tuple[str, ...], list[NamedColumn]]
) -> list[NamedColumn]:
    """Gyroscopes of an IMU: those with its label, or the only ones."""
    return gyr.get(label) or (next(iter(gyr.values())) if len(gyr) == 1 else [])


def _columns_of_imu(
    named: Iterable[NamedColumn], label: tuple[str, ...]
) -> list[NamedColumn]:
    """Columns whose names have the label of one of several IMUs."""
    return [n for n in named if label and set(label) <= set(n.says.label)]


def _plainest(named: Sequence[NamedColumn], but: Sequence[str]) -> list[NamedColumn]:
    """One of several columns: the shortest name, without `but` if possible."""
    return sorted(
        named, key=lambda n: (bool(set(n.says.label) & set(but)), len(n.says.label))
    )[:1]


def _stamps(times: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Times of measurement, without times of arrival if there are both."""
    whole = [n for n in times if n.says.unit is None and "header" in n.says.label]
    return whole or [*times]


def _thermometer(
    named: Iterable[NamedColumn], label: tuple[str, ...]
) -> tuple[list[NamedColumn], tuple[str, ...]]:
    """Return the thermometer nearest to an IMU, and a message about it.

    Of those that only their unit tells, there must be one.
    """
    warm = [n for n in named if n.says.kind == "temperature"]
    called = [n for n in warm if not n.says.weak]
    near = [n for n in warm if not {*n.says.label} & {*FOREIGN}] or warm
    warm = called or (near if len(near) == 1 else _columns_of_imu(warm, label))
    near = _columns_of_imu(warm, label) or [
        n for n in warm if not set(n.says.label) & set(FOREIGN)
    ]
    if near or not warm:
        return _plainest(near, ()), ()
    chosen = _plainest(warm, ())
    other = " ".join(chosen[0].says.label)
    return chosen, (
        f"its only thermometer is that of the {other}: it is taken, but lies apart from"
        " the IMU, so what goes with temperature may lag",
    )


def _match(
    columns: Sequence[Column],
    chosen: Sequence[NamedColumn],
    skip: str,
    name: str,
    says: tuple[str, ...],
) -> HeadingMatch:
    """Match of the chosen columns for one IMU."""
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
    forces = [n for n in chosen if n.says.kind in ("a", "l")]
    apple = [columns[n.number].name for n in forces]
    turned, told = sign_of_ios(apple, [c.name for c in columns], units.get("a"))
    reversed_ = frozenset(n.says.kind + n.says.axis for n in forces if turned)
    says = (*says, told) if told else says
    axes = [words_in_name(columns[n.number].name) for n in chosen if n.says.axis]
    ros = all(any({*part} <= {*words} for part in ROS) for words in axes)
    usual = "rad/s" if ros else ""
    return HeadingMatch(tuple(found), units, name, says, usual, reversed_)
