"""Columns that no name tells, told by the physics of what they hold.

Time only grows. Of two sets of three axes, one is the specific force and the other the
rate of turn if at rest the first has the length of gravity in a usual unit, and turns
in device axes as the second says. A magnetometer's field turns likewise, but has not
that length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.importing.tables.axis_triples import (
    Three,
    channels_of,
    free_columns,
)
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
    binary_counts,
    fitting_scales,
    gain_scales,
)
from fieldcal.importing.units.time_units import usual_step

NOISY = 0.1
"""Part of gravity that its own noise is not."""

EXACT = 5e-5
"""Part by which a direction's length differs: a sensor has scatter and bias."""

AS_LONG, MOVED = 0.3, 0.1
"""Part by which |a| differs from gravity in few rows, even of a moved device; and the
share of these rows."""

BY_TURNS = "gravity turns in the first three as the other three say"

LEAST_COUNTS = 1000.0
"""Counts in a g by which an accelerometer is told without turns."""


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
    free = free_columns(table, names, known)
    channels = dict(free.channels)
    found = _force_and_rate_triples(table, free.clock, free.forces, free.rates)
    alone = free.named and {*free.forces, *free.rates} == {*free.named}
    if found is None and not alone:
        return None
    # of one sensor that is named, with nothing beside it, the time may be told
    (acc, gyr), why = found or ((None, None), "")
    for kind, three in (("a", acc), ("g", gyr)):
        if three is not None:
            channels |= channels_of(kind, three)
    new = {name for i, name in channels.items() if known.get(i) != name}
    if not new:
        return None
    return IdentifiedColumns(
        channels, "the time is the first that only grows" if new == {"t"} else why
    )


def possible_columns(
    table: Array, names: Sequence[str], known: Mapping[int, str]
) -> list[dict[int, str]]:
    """Channels by column, of each two sets of axes that turn as one says of the other.

    Parameters
    ----------
    table, names, known : as of `identify_columns`

    """
    if len(table) < FEWEST_MEANS:
        return []
    free = free_columns(table, names, known)
    sizes = _usual_forces(table, free.clock, free.forces)
    pairs = _turning_pairs(table, free.clock, sizes, free.rates)
    return [
        {**free.channels, **channels_of("a", force), **channels_of("g", rate)}
        for force, rate in pairs
    ]


def turning_columns(
    table: Array, names: Sequence[str], known: Mapping[int, str]
) -> IdentifiedColumns | None:
    """The only two sets of axes that turn as one says of the other; None otherwise.

    Parameters
    ----------
    table, names, known : as of `identify_columns`

    """
    found = possible_columns(table, names, known)
    return IdentifiedColumns(found[0], BY_TURNS) if len(found) == 1 else None


def _force_and_rate_triples(
    table: Array, clock: Array, forces: Sequence[Three], rates: Sequence[Three]
) -> tuple[tuple[Three, Three | None], str] | None:
    """Specific force and rate among sets of axes, and why."""
    sizes = _usual_forces(table, clock, forces)
    usual = [*sizes]
    turning = _turning_pairs(table, clock, sizes, rates)
    if len(turning) == 1:
        return turning[0], BY_TURNS
    if turning:
        return None
    if usual_step(clock) and not any(_gravity(table, three) for three in usual):
        others = {*forces, *rates} - {*usual}
        why = "the length of the first three at rest is what gravity gains in a step"
        # the other one of two is what angle gained
        alone = len(usual) == len(others) == 1
        return ((usual[0], others.pop()), why) if alone else None
    # of counts, any length is one: without a turn they are asked about
    usual = _gravity_alone(table, sizes)
    if len(usual) == 1:
        pairs = [p for p in permutations({*forces, *rates}, 2) if p[0] == usual[0]]
        apart = [rate for _, rate in pairs if not set(rate) & set(usual[0])]
        if len(apart) <= 1 and len({*forces, *rates}) - len(apart) == 1:
            why = "the length of the first three at rest is that of gravity"
            if apart and _denied(table, clock, usual[0], apart[0], sizes[usual[0]]):
                return (usual[0], None), f"{why}, and no others turn as they do"
            return (usual[0], apart[0] if apart else None), why
    return None


def likely_columns(
    table: Array, names: Sequence[str], known: Mapping[int, str]
) -> list[dict[int, str]]:
    """Channels by column where no turn tells the rates, the likeliest first.

    The forces keep the length of gravity in most rows: of two sets that share axes at
    rest, one does so when the device is moved. The rates stand beside them, and are no
    forces themselves. The last ways have forces alone: the likeliest, and those of
    other devices.

    Parameters
    ----------
    table, names, known : as of `identify_columns`

    """
    if len(table) < FEWEST_MEANS:
        return []
    free = free_columns(table, names, known)
    sizes = _usual_forces(table, free.clock, free.forces)
    usual = _gravity_alone(table, sizes)
    if not usual:
        return []
    kept = {three: _share_of_gravity(table, three, sizes[three]) for three in usual}
    most = max(kept.values())
    forces = sorted(f for f in usual if kept[f] > most - MOVED)
    ways = [
        (force, rate) for force in forces for rate in free.rates
        if rate not in forces and not set(rate) & set(force)
    ]  # fmt: skip
    ways.sort(key=lambda way: (abs(way[1][0] - way[0][0]), way))
    devices = [forces[0]]
    devices += [f for f in forces[1:] if not set(f) & {i for d in devices for i in d}]
    return [
        *({**free.channels, **channels_of("a", f), **channels_of("g", w)}
          for f, w in ways),
        *({**free.channels, **channels_of("a", f)} for f in devices),
    ]  # fmt: skip


def _gravity_alone(table: Array, sizes: Mapping[Three, GravityReading]) -> list[Three]:
    """Sets of axes whose length alone tells that they feel gravity."""
    return [
        three for three, size in sizes.items()
        if (_is_usual_gravity(size) or _is_binary_g(table[:, list(three)], size))
        and unequal_lengths(table[:, list(three)]) is None
    ]  # fmt: skip


def _is_binary_g(values: Array, size: GravityReading) -> bool:
    """Whether numbers (n, 3) about as long as one are counts of a power of two in it.

    Nothing else has both, so biases of a tenth of g are allowed for.
    """
    near = abs(float(np.log(size.size))) < ACC_OUT[1]
    return near and binary_counts(values) > 0


def _share_of_gravity(table: Array, three: Three, size: GravityReading) -> float:
    """Share of rows in which three columns are about as long as gravity."""
    length = np.linalg.norm(table[:, list(three)] - size.offset, axis=1)
    return float((np.abs(length / size.size - 1) < AS_LONG).mean())


def _usual_forces(
    table: Array, clock: Array, forces: Sequence[Three]
) -> dict[Three, GravityReading]:
    """Sets of axes whose length is that of gravity in a usual unit, and this."""
    sizes = {three: _gravity(table, three) for three in forces}
    if not any(sizes.values()) and (step := usual_step(clock)):
        # no force, but what velocity and angle gained since the row before
        sizes = {three: _gravity(table, three, step) for three in forces}
    usual = {three: size for three, size in sizes.items() if size is not None}
    # a sphere through rests in many directions is no accident
    return {three: size for three, size in usual.items() if size.round} or usual


def _turning_pairs(
    table: Array,
    clock: Array,
    forces: Mapping[Three, GravityReading],
    rates: Sequence[Three],
) -> list[tuple[Three, Three]]:
    """Forces and rates that gravity turns by."""
    even = _scaled_to_10_ms_steps(clock)
    return [
        (force, rate)
        for force, gravity in forces.items()
        for rate in rates
        if not set(force) & set(rate)
        and estimate_rate_unit(even, table[:, list(force)], table[:, list(rate)],
                               gravity) is not None
    ]  # fmt: skip


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
    # between them may stand rows of another sensor
    whole = values[np.isfinite(values).all(axis=1)]
    differ = np.abs(np.diff(whole, axis=0))
    return len(whole) > 1 and bool(np.median(differ, axis=0).max() > NOISY * size)


def is_direction(values: Array) -> bool:
    """Whether rows (n, 3) have the same length: calculated, not measured."""
    if are_means(values):
        return False
    whole = values[np.isfinite(values).all(axis=1)]
    length = np.linalg.norm(whole, axis=1)
    moves = len(whole) and np.ptp(whole, axis=0).max() > NOISY * np.median(length)
    return bool(moves and np.ptp(length) < EXACT * np.median(length))


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
