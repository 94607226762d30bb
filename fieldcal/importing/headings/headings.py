"""Headings of columns that state channels and units, of one IMU or of several.

Taken is only what leaves no choice: each channel of an IMU is there once, and axes come
in threes. A unit that no heading says is left to physics or to the user. Where a log
has several IMUs, what their names do not share tells them apart, and what one alone has
(the time, the only thermometer, the only gyroscopes) belongs to all.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from fieldcal.importing.headings.best_columns import NamedColumn, best_columns
from fieldcal.importing.headings.filtered_axes import (
    list_names,
    tell_filtered,
    without_filtered,
)
from fieldcal.importing.headings.heading import Column, HeadingMatch
from fieldcal.importing.headings.low_words import without_low_words
from fieldcal.importing.headings.numbered_axes import with_lettered_axes
from fieldcal.importing.headings.repeated_names import with_distinct_names
from fieldcal.importing.words.heading_units import HALF_ANGLE, UNITS
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
from fieldcal.importing.words.rate_names import RATES
from fieldcal.importing.words.sensor_words import AXES
from fieldcal.importing.words.telephone_names import sign_of_ios
from fieldcal.importing.words.thermometer_words import BESIDE_THERMOMETERS, FOREIGN

NOT_SAMPLES = (*SCATTER, "min", "max", "median", "bias", "offset", "cov",
               "magnitude", "norm", "drift", "delta", "angle", "angles",
               "covariance", "valid", "validity", "flag", "status", "command",
               "commanded", "cmd", "desired", "des", "setpoint", "sp", "target",
               "error", "err", "residual", "innovation")  # fmt: skip
"""Words of columns that are no samples of a sensor: what is made of them, or wanted."""

ANGULAR = ("angular", "ang", "rotational")
"""Words of accelerations that are none of an accelerometer."""

ROS = (("angular", "velocity"), ("linear", "acceleration"), ("ang", "vel"),
       ("lin", "acc"))  # fmt: skip
"""Words of the axes of ROS's sensor_msgs/Imu, which is defined in rad/s."""

CLOCK_PARTS = ("t_h", "t_min")
"""Kinds of columns that are added to the seconds of a clock."""

OTHER_CLOCK = ("host", "utc", "gps", "system", "local", "unix", "arrival", "arrived",
               "log", "receive", "received", "recv", "reception", "rx",
               "recorded", "meta")  # fmt: skip
"""Words of times that are another clock's than the device's."""

ACCELERATION = ("acc", "beschl")
"""Beginnings of words that say acceleration, and no gain of velocity."""

GAIN_SPANS = ("dv_us", "da_us")
"""Channels of the time over which velocity and angle were gained."""

MAVLINK_FORCES = ("xacc", "yacc", "zacc")
"""Fields of MAVLink's messages: mg in SCALED_IMU, and as ArduPilot fills RAW_IMU."""

ANGLES = ("roll", "pitch", "yaw", "heading", "azimuth", "euler", "quat", "quaternion")
"""Words of what a filter computes of an attitude."""


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
    columns = with_distinct_names(with_lettered_axes(columns))
    named = [
        NamedColumn(i, said)
        for i, column in enumerate(columns)
        if "," not in column.place
        and (said := heading_meaning(column.name, column.unit)) is not None
        and (said.kind == "t" or not _is_no_sample(said))
    ]
    named, low = without_low_words(named)
    named, filtered = without_filtered(named)
    named = best_columns(columns, named)
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
    parts = [n for n in named if n.says.kind in CLOCK_PARTS]
    steps = [n for n in named if n.says.kind == "dt"][:1]
    apart = [n for n in named if n.says.kind == "l"]
    rates = _rates_by_force(acc, gyr)
    found = []
    for label in acc or gyr:
        both = [*acc.get(label, ()), *(rates[label] if acc else gyr[label])]
        spans = [n for n in named if n.says.kind in GAIN_SPANS
                 and any(one.says.gain for one in both)]  # fmt: skip
        warm, says = _thermometer(named, label)
        rest = _plainest([n for n in named if n.says.kind == "seq"], ())
        rest += [n for n in named if n.says.kind == "t_host"][:1]
        clock = _plainest(_columns_of_imu(times, label) or times, OTHER_CLOCK)
        clock = [_nearest_before(clock[0], times, both, columns)] if clock else steps
        chosen = [*clock, *parts, *both, *spans, *apart, *warm, *rest]
        found.append(_match(columns, chosen, skip, "_".join(label) or "0", says))
    if left := [three for three in gyr.values() if acc and three not in rates.values()]:
        told = _left_out(list_names(columns, left[0]))
        found[0] = replace(found[0], says=(*found[0].says, told))
    taken = [n for three in (*acc.values(), *gyr.values()) for n in three]
    told_of_filters = tell_filtered(columns, filtered, taken)
    if low:
        lower = f"{list_names(columns, low)}: lower halves of words; left out, so that"
        told_of_filters.append(f"{lower} a step is one of 16 bits")
    found[0] = replace(found[0], says=(*found[0].says, *told_of_filters))
    if len(found) == 1:
        found = [replace(found[0], name="0")]
    return tuple(found)


def match_beside(columns: Sequence[Column], skip: str = "") -> HeadingMatch | None:
    """Match times and the thermometer, where no name says an axis; None of others."""
    found = [(i, heading_meaning(c.name, c.unit)) for i, c in enumerate(columns)]
    named = [NamedColumn(i, said) for i, said in found if said is not None]
    times = _stamps([n for n in named if n.says.kind == "t"])
    parts = [n for n in named if n.says.kind in CLOCK_PARTS]
    warm, says = _thermometer(named, ())
    chosen = [*_plainest(times, OTHER_CLOCK), *parts, *warm]
    return _match(columns, chosen, skip, "0", says) if chosen else None


def are_free(columns: Sequence[Column]) -> bool:
    """Whether columns are called as accelerations without gravity are.

    >>> are_free([Column("", "Linear Acceleration x"), Column("", "ay")])
    True
    """
    said = [heading_meaning(column.name, column.unit) for column in columns]
    return any(s and s.kind == "a" and s.weak and not s.gain for s in said)


def _left_out(names: str) -> str:
    """Say that rates are taken of no IMU."""
    return f"{names}: go with no accelerometers by their names; left out"


def columns_without_axes(columns: Sequence[Column], turns: bool = False) -> list[int]:
    """Columns whose names exclude that they are axes of an IMU.

    With `turns`, gravity's turns will tell a rate from an angle that was integrated
    from it, both of which are called ``gyro_roll``.
    """
    found = []
    for i, column in enumerate(columns):
        said, words = (
            heading_meaning(column.name, column.unit),
            {*words_in_name(column.name)},
        )
        kind = said.kind if said is not None else ""
        if (
            words & {*SCATTER, *REFERENCE}
            or kind == "m"
            or (words & {*ANGLES} and kind != "g" and not (turns and words & {*RATES}))
        ):
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


def _rates_by_force(
    acc: Mapping[tuple[str, ...], list[NamedColumn]],
    gyr: Mapping[tuple[str, ...], list[NamedColumn]],
) -> dict[tuple[str, ...], list[NamedColumn]]:
    """Gyroscopes of each IMU, by the label of its accelerometers.

    Those with its label, the only ones, or those that share the most words with it.
    """
    found = {}
    for label in acc:
        shared = {own: len({*own} & {*label}) for own in gyr if own not in acc}
        best = [own for own, many in shared.items() if many == max(shared.values())]
        alike = len(best) == 1 and shared[best[0]]
        only = next(iter(gyr)) if len(gyr) == 1 else best[0] if alike else label
        found[label] = gyr.get(label) or gyr.get(only) or []
    return found


def _nearest_before(
    clock: NamedColumn,
    times: Sequence[NamedColumn],
    axes: Sequence[NamedColumn],
    columns: Sequence[Column],
) -> NamedColumn:
    """The time that stands next before the first axis, of those that are called alike.

    Programs that write a time before each channel write one for each of their rates.
    """
    first = min(n.number for n in axes)
    name = columns[clock.number].name
    alike = [n for n in times if columns[n.number].name == name and n.number < first]
    return max(alike, key=lambda n: n.number, default=clock)


def _is_no_sample(said: HeadingMeaning) -> bool:
    """Whether the words of a column say that it holds no samples of a sensor."""
    # one of low noise is a sensor
    quiet = {"noise"} if "low" in said.label else set()
    others = (*NOT_SAMPLES, *(ANGULAR if said.kind == "a" else ()))
    return bool(({*said.label} - quiet) & {*others})


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
    ros = bool(axes) and all(any({*part} <= {*words} for part in ROS) for words in axes)
    half = any(n.says.half for n in chosen)
    usual = HALF_ANGLE if half else "rad/s" if ros else ""
    felt = [n for n in chosen if n.says.kind == "a" and not n.says.gain]
    mavlink = felt and all(
        {*MAVLINK_FORCES} & {*words_in_name(columns[n.number].name)} for n in felt
    )
    free = any(n.says.weak for n in felt)
    # "a" alone may be short for anything
    words = [w for n in felt for w in words_in_name(columns[n.number].name)]
    no_gain = free or any(w.startswith(ACCELERATION) for w in words)
    return HeadingMatch(
        tuple(found), units, name, says, usual, reversed_, free, no_gain,
        "mg" if mavlink else "",
    )  # fmt: skip
