"""Columns that no name tells, told by the physics of what they hold.

Time only grows. Of two sets of three axes, one is the specific force and the other the
rate of turn if at rest the first has the length of gravity in a usual unit, and turns
in device axes as the second says. A magnetometer's field turns likewise, but has not
that length.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.importing.units.gravity_size import (
    FEWEST_MEANS,
    GravityReading,
    are_means,
    estimate_gravity,
    unequal_lengths,
)
from fieldcal.importing.units.rate_size import estimate_rate_unit, turns_deny
from fieldcal.importing.units.scales import (
    ACC_OUT,
    ACC_SCALES,
    MIN_ROWS,
    fitting_scales,
    gain_scales,
)
from fieldcal.importing.units.time_units import usual_step
from fieldcal.importing.words.heading_words import heading_meaning, is_counter
from fieldcal.importing.words.sensor_words import AXES

GROWS = 0.999
"""Share of steps of a time that are positive: a line may be damaged."""

RATES = ("p", "q", "r")
"""What those who fly call rates about x, y and z."""

NOISY = 0.1
"""Part of gravity that its own noise is not."""

EXACT = 5e-5
"""Part by which a direction's length differs: a sensor has scatter and bias."""

UNIT_LENGTH = 0.02
"""Part by which the length of a quaternion of two decimals may differ from 1."""

LEAST_COUNTS = 1000.0
"""Counts in a g by which an accelerometer is told without turns."""

Three = tuple[int, int, int]


class IdentifiedColumns(NamedTuple):
    """Channels that were identified from the numbers of columns.

    Attributes
    ----------
    channels : by the number of the column
    why : the reason, as it goes on behind "taken as"

    """

    channels: Mapping[int, str]
    why: str


def identify_columns(
    table: Array, names: Sequence[str], known: Mapping[int, str]
) -> IdentifiedColumns | None:
    """Identify time, specific force and rate among columns; None if none is found.

    Parameters
    ----------
    table : (n, k) nan where a cell is no number
    names : (k) over the columns, or nothing
    known : channels that are named, by column

    """
    if len(table) < FEWEST_MEANS:
        return None
    channels = dict(known)
    times = [i for i in _growing(table) if i not in known]
    if "t" not in channels.values():
        clocks = [
            i for i in times if not (_counts(table[:, i]) or is_counter(names[i]))
        ]
        if clocks:
            # a thermometer may only grow as well, but the time stands first
            channels[next((i for i in clocks if _says_time(names[i])), clocks[0])] = "t"
    t = next((i for i, name in channels.items() if name == "t"), None)
    clock: Array = np.arange(len(table), dtype=float) if t is None else table[:, t]
    free = [i for i in range(table.shape[1]) if i not in {*known, *times}]
    acc = _named(known, "a")
    gyr = _named(known, "g")
    attitude = _quaternions(table)
    moving = [i for i in free if _moves(table[:, i]) and i not in attitude]
    threes = _axis_triples(moving, names)
    found = _force_and_rate_triples(
        table, clock, [acc] if acc else threes, [gyr] if gyr else threes
    )
    if found is None:
        return None
    (acc, gyr), why = found
    for kind, three in (("a", acc), ("g", gyr)):
        if three is not None:
            channels |= {i: kind + axis for i, axis in zip(three, AXES, strict=True)}
    new = {name for i, name in channels.items() if known.get(i) != name}
    if not new:
        return None
    return IdentifiedColumns(
        channels, "the time is the first that only grows" if new == {"t"} else why
    )


def unnamed_axes(
    table: Array, names: Sequence[str], known: Collection[int]
) -> list[Three]:
    """Columns without known meaning that vary and may be three axes.

    An axis may rest within one step of its output, if its name says that it is one.
    """
    if len(table) < MIN_ROWS or table.shape[1] != len(names):
        return []
    without = {*known, *_growing(table), *_quaternions(table)}
    free = [i for i in range(table.shape[1]) if i not in without]
    moving = [i for i in free if _moves(table[:, i])]
    named = [three for three in _by_name(free, names) if {*three} & {*moving}]
    return _axis_triples(moving, names) or named


def _says_time(name: str) -> bool:
    """Whether a column is called a time."""
    said = heading_meaning(name)
    return said is not None and said.kind == "t"


def _growing(table: Array) -> list[int]:
    """Columns that only grow."""
    found = []
    for i in range(table.shape[1]):
        column = table[:, i]
        steps = np.diff(column[np.isfinite(column)])
        if len(steps) > len(table) / 2 and (steps > 0).mean() >= GROWS:
            found.append(i)
    return found


def _counts(column: Array) -> bool:
    """Whether a column counts rows."""
    steps = np.diff(column[np.isfinite(column)])
    return bool((steps == 1).mean() > GROWS)


def _quaternions(table: Array) -> set[int]:
    """Columns that are an attitude: of four side by side the length is always 1.

    That of an accelerometer in g beside a calm gyroscope is that of three of them.
    """
    found: set[int] = set()
    for i in range(table.shape[1] - 3):
        four = table[:, i : i + 4]
        four = four[np.isfinite(four).all(axis=1)]
        threes = (four[:, :3], four[:, 1:])
        if _has_unit_length(four) and not any(map(_has_unit_length, threes)):
            found |= {*range(i, i + 4)}
    return found


def _has_unit_length(values: Array) -> bool:
    off = np.abs(np.linalg.norm(values, axis=1) - 1)
    return bool(len(off) and off.max() < UNIT_LENGTH)


def _moves(column: Array) -> bool:
    known = column[np.isfinite(column)]
    return len(known) > len(column) / 2 and float(np.ptp(known)) > 0


def _named(known: Mapping[int, str], kind: str) -> Three | None:
    where = {name: i for i, name in known.items()}
    if not all(kind + axis in where for axis in AXES):
        return None
    x, y, z = (where[kind + axis] for axis in AXES)
    return x, y, z


def _axis_triples(free: Sequence[int], names: Sequence[str]) -> list[Three]:
    """Columns that may be three axes, by their names or their order."""
    whole = _by_name(free, names)
    if whole and len({names[i] for i in free}) == len(free):
        return whole
    beside = zip(free, free[1:], free[2:], strict=False)
    side = [(a, b, c) for a, b, c in beside if c == a + 2]
    parted = len(free) % len(AXES) == 0 and len(side) == len(free) - len(AXES) + 1
    return side[:: len(AXES)] if parted else side


def _by_name(free: Sequence[int], names: Sequence[str]) -> list[Three]:
    """Columns that are three axes, by the words that their names share."""
    found: list[Three] = []
    for letters in (AXES, RATES):
        stems: dict[str, dict[str, int]] = {}
        form = re.compile(rf"(.*?)[_ .]?([{''.join(letters)}])(\W.*|)")
        for i in free:
            if matched := form.fullmatch(names[i].lower()):
                stem = f"{matched.group(1)}|{matched.group(3)}"
                stems.setdefault(stem, {})[matched.group(2)] = i
        x, y, z = letters
        found += [(s[x], s[y], s[z]) for s in stems.values() if len(s) == len(letters)]
    return found


def _force_and_rate_triples(
    table: Array, clock: Array, forces: Sequence[Three], rates: Sequence[Three]
) -> tuple[tuple[Three, Three | None], str] | None:
    """Specific force and rate among sets of axes, and why."""
    sizes = {three: _gravity(table, three) for three in forces}
    usual = [three for three in forces if sizes[three] is not None]
    if not usual and (step := usual_step(clock)):
        # no force, but what velocity and angle gained since the row before
        sizes = {three: _gravity(table, three, step) for three in forces}
        usual = [three for three in forces if sizes[three] is not None]
    # a sphere through rests in many directions is no accident
    usual = [three for three in usual if _is_round(sizes[three])] or usual
    turning = []
    for force in usual:
        gravity = sizes[force]
        for rate in rates:
            if set(force) & set(rate) or gravity is None:
                continue
            acc, gyr = table[:, list(force)], table[:, list(rate)]
            if (
                estimate_rate_unit(_scaled_to_10_ms_steps(clock), acc, gyr, gravity)
                is not None
            ):
                turning.append((force, rate))
    if len(turning) == 1:
        return turning[0], "gravity turns in the first three as the other three say"
    if turning:
        return None
    if usual_step(clock) and not any(_gravity(table, three) for three in usual):
        others = {*forces, *rates} - {*usual}
        why = "the length of the first three at rest is what gravity gains in a step"
        # the other one of two is what angle gained
        alone = len(usual) == len(others) == 1
        return ((usual[0], others.pop()), why) if alone else None
    # of counts, any length is one: without a turn they are asked about
    usual = [three for three in usual if _is_usual_gravity(sizes[three])
             and unequal_lengths(table[:, list(three)]) is None]  # fmt: skip
    if len(usual) == 1:
        pairs = [p for p in permutations({*forces, *rates}, 2) if p[0] == usual[0]]
        apart = [rate for _, rate in pairs if not set(rate) & set(usual[0])]
        if len(apart) <= 1 and len({*forces, *rates}) - len(apart) == 1:
            why = "the length of the first three at rest is that of gravity"
            if apart and _denied(table, clock, usual[0], apart[0], sizes[usual[0]]):
                return (usual[0], None), f"{why}, and no others turn as they do"
            return (usual[0], apart[0] if apart else None), why
    return None


def _denied(
    table: Array, clock: Array, force: Three, rate: Three, size: GravityReading | None
) -> bool:
    """Whether the device turns, and not as columns that may be its rates say."""
    acc, gyr = table[:, list(force)], table[:, list(rate)]
    return size is not None and turns_deny(
        _scaled_to_10_ms_steps(clock), acc, gyr, size
    )


def _scattered(values: Array, size: float) -> bool:
    """Whether values (n, 3) are noise: their changes from row to row are large."""
    if are_means(values):
        return False
    differ = np.abs(np.diff(values, axis=0))
    return bool(np.nanmedian(differ, axis=0).max() > NOISY * size)


def is_direction(values: Array) -> bool:
    """Whether rows (n, 3) have the same length: calculated, not measured."""
    if are_means(values):
        return False
    whole = values[np.isfinite(values).all(axis=1)]
    length = np.linalg.norm(whole, axis=1)
    moves = len(whole) and np.ptp(whole, axis=0).max() > NOISY * np.median(length)
    return bool(moves and np.ptp(length) < EXACT * np.median(length))


def _is_round(gravity: GravityReading | None) -> bool:
    return gravity is not None and gravity.round


def _is_usual_gravity(gravity: GravityReading | None) -> bool:
    """Whether a length is gravity in a unit, or in counts of an 16-bit sensor."""
    within = ACC_OUT[0]
    fits = fitting_scales(gravity.size, ACC_SCALES, within) if gravity else []
    return any(fit.lsb == 1 or fit.lsb >= LEAST_COUNTS for fit in fits)


def _scaled_to_10_ms_steps(clock: Array) -> Array:
    """A clock (n,) scaled to a median step of 10 ms, whatever its unit."""
    steps = np.diff(clock[np.isfinite(clock)])
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    scaled: Array = clock * (0.01 / step)
    return scaled


def _gravity(table: Array, three: Three, step: float = 0.0) -> GravityReading | None:
    """Length of three columns at rest, if it is gravity in a usual unit.

    Parameters
    ----------
    table, three : (n, k) and the columns
    step : s, where the columns hold the gain of velocity over it; 0 where not

    """
    values = table[:, list(three)]
    found = estimate_gravity(values)
    if found is None or _scattered(values, found.size) or is_direction(values):
        return None
    within = ACC_OUT[not found.round]
    scales = gain_scales(step, "m/s^2", G0) if step else ACC_SCALES
    return found if fitting_scales(found.size, scales, within) else None
