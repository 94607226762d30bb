"""Headings of columns that state channels and units, of one IMU or of several.

Taken is only what leaves no choice: each channel of an IMU is there once, and axes come
in threes. A unit that no heading says is left to physics or to the user. Where a log
has several IMUs, what their names do not share tells them apart, and what one alone has
(the time, the only thermometer, the only gyroscopes) belongs to all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fieldcal.importing.headings.axis_triads import rates_by_force, triads
from fieldcal.importing.headings.best_columns import NamedColumn, best_columns
from fieldcal.importing.headings.filtered_axes import (
    list_names,
    tell_filtered,
    without_filtered,
)
from fieldcal.importing.headings.heading import Column, HeadingMatch
from fieldcal.importing.headings.low_words import lower_halves, split_low_words
from fieldcal.importing.headings.numbered_axes import with_lettered_axes
from fieldcal.importing.headings.repeated_names import with_distinct_names
from fieldcal.importing.headings.thermometer_columns import thermometer
from fieldcal.importing.headings.time_columns import (
    OTHER_CLOCK,
    columns_of_imu,
    nearest_before,
    plainest,
    stamps,
)
from fieldcal.importing.words.heading_units import HALF_ANGLE, UNITS
from fieldcal.importing.words.heading_words import (
    REFERENCE,
    SCATTER,
    HeadingMeaning,
    bare_axis,
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
    named, low = split_low_words(named)
    named, filtered = without_filtered(named)
    named = best_columns(columns, named)
    acc, gyr = triads(named, "a"), triads(named, "g")
    if acc is None or gyr is None:
        return ()
    if not (acc or gyr):
        return _match_thermometer_file(columns, named, skip)
    # without gyroscopes beside it, a "linear acceleration" may lack gravity
    lacking = all(one.says.weak for three in acc.values() for one in three)
    if not gyr and lacking and not weak:
        return ()
    times = stamps([n for n in named if n.says.kind == "t"])
    parts = [n for n in named if n.says.kind in CLOCK_PARTS]
    steps = [n for n in named if n.says.kind == "dt"][:1]
    apart = [n for n in named if n.says.kind == "l"]
    rates = rates_by_force(acc, gyr)
    found = []
    for label in acc or gyr:
        both = [*acc.get(label, ()), *(rates[label] if acc else gyr[label])]
        spans = [n for n in named if n.says.kind in GAIN_SPANS
                 and any(one.says.gain for one in both)]  # fmt: skip
        warm, says = thermometer(named, label)
        rest = plainest([n for n in named if n.says.kind == "seq"], ())
        rest += [n for n in named if n.says.kind == "t_host"][:1]
        clock = plainest(columns_of_imu(times, label) or times, OTHER_CLOCK)
        clock = [nearest_before(clock[0], times, both, columns)] if clock else steps
        halves = lower_halves(low, both)
        chosen = [*clock, *parts, *both, *halves, *spans, *apart, *warm, *rest]
        found.append(_match(columns, chosen, skip, "_".join(label) or "0", says))
    if left := [three for three in gyr.values() if acc and three not in rates.values()]:
        told = _left_out(list_names(columns, left[0]))
        found[0] = replace(found[0], says=(*found[0].says, told))
    taken = [n for three in (*acc.values(), *gyr.values()) for n in three]
    told_of_filters = tell_filtered(columns, filtered, taken)
    found[0] = replace(found[0], says=(*found[0].says, *told_of_filters))
    if len(found) == 1:
        found = [replace(found[0], name="0")]
    return tuple(found)


def match_beside(columns: Sequence[Column], skip: str = "") -> HeadingMatch | None:
    """Match times and the thermometer, where no name says an axis; None of others."""
    found = [(i, heading_meaning(c.name, c.unit)) for i, c in enumerate(columns)]
    named = [NamedColumn(i, said) for i, said in found if said is not None]
    times = stamps([n for n in named if n.says.kind == "t"])
    parts = [n for n in named if n.says.kind in CLOCK_PARTS]
    warm, says = thermometer(named, ())
    chosen = [*plainest(times, OTHER_CLOCK), *parts, *warm]
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
    clock = plainest(stamps(times), OTHER_CLOCK)
    _, says = thermometer(chosen, ()) if others else ([], ())
    return (_match(columns, [*clock, *chosen], skip, "0", says),)


def _is_no_sample(said: HeadingMeaning) -> bool:
    """Whether the words of a column say that it holds no samples of a sensor."""
    # one of low noise is a sensor
    quiet = {"noise"} if "low" in said.label else set()
    others = (*NOT_SAMPLES, *(ANGULAR if said.kind == "a" else ()))
    return bool(({*said.label} - quiet) & {*others})


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
