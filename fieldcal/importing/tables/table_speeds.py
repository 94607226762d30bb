"""Rates at which a table turned a device, in a column beside the means of its outputs.

    rate (deg/s),gx_mean,gy_mean,gz_mean,gx_std,gy_std,gz_std

The axis need not be known: whatever it is, the rates that the gyroscopes saw are as
long as that of the table, which tells the unit of a column that says none. Of a table
with several axes, a column for each, the rate is as long as the vector of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.read_options import RATE_UNITS
from fieldcal.importing.units.gravity_size import MOST_AT_REST
from fieldcal.importing.words.heading_words import heading_meaning, words_in_name
from fieldcal.importing.words.name_and_unit import name_unit_splits

SPEEDS = ("rate", "speed", "omega")
"""Words of the rate of a table."""

BESIDE = ("table", "turntable", "cmd", "command", "commanded", "set", "setpoint",
          "target", "nominal", "angular", "deg", "s", "dps", "rad")  # fmt: skip
"""Words that stand beside them and say no more."""

COMMANDED = ("cmd", "command", "commanded", "setpoint", "table", "turntable")
"""Words by which a rate of an axis is the table's without a word for a rate."""

OF_AXES = ("x", "y", "z", "inner", "middle", "outer")
"""What tells the axes of a table apart, which are perpendicular to each other."""

UNITS = ("deg/s", "rad/s")

OFF = 0.3
"""Logarithm of what the rates of gyroscopes are off that of the table at most."""

NO_BIAS = 0.5
"""Rate that no gyroscope has at rest, rad/s."""


def speed_columns(columns: Sequence[Column]) -> list[int]:
    """Columns of the rate of a table, those of its axes if it has several.

    Empty if no column is, or several are of the same axis.

    >>> names = ("rate (deg/s)", "gx_mean", "gyro rate x", "speed_dps")
    >>> speed_columns([Column("", name) for name in names[:3]])
    [0]
    >>> speed_columns([Column("", name) for name in names])
    []
    >>> speed_columns([Column("", f"cmd_{axis} (deg/s)") for axis in "xyz"])
    [0, 1, 2]
    >>> speed_columns([Column("", "inner_rate_dps"), Column("", "outer_rate_dps")])
    [0, 1]
    """
    found = [i for i, column in enumerate(columns) if _is_speed(column)]
    if len(found) == 1:
        return found
    names = [{*words_in_name(column.name)} for column in columns]
    of_axes = {
        i: own.pop()
        for i, words in enumerate(names)
        if len(own := words & {*OF_AXES}) == 1 and _is_of_axis(columns[i])
    }
    rest = {frozenset(names[i] - {axis}) for i, axis in of_axes.items()}
    units = {speed_unit(columns[i]) for i in of_axes}
    distinct = len({*of_axes.values()}) == len(of_axes)
    several = 1 < len(of_axes) <= len("xyz")
    whole = several and distinct and len(rest) == len(units) == 1 and not found
    return [*of_axes] if whole else []


def _is_speed(column: Column) -> bool:
    words = {*words_in_name(column.name)}
    bare = words & {*SPEEDS} and words <= {*SPEEDS, *BESIDE}
    return bool(bare) and heading_meaning(column.name, column.unit) is None


def _is_of_axis(column: Column) -> bool:
    """Whether a column is the rate of one axis of a table, of no sensor."""
    words = {*words_in_name(column.name)}
    bare = words & {*SPEEDS, *COMMANDED} and words <= {*SPEEDS, *BESIDE, *OF_AXES}
    said = heading_meaning(column.name, column.unit)
    commanded = bool(words & {*COMMANDED})
    return bool(bare) and (said is None or not said.kind or commanded)


def speed_unit(column: Column) -> str:
    """Unit that the name of a column says, "" if none."""
    splits = name_unit_splits(column.name, column.unit)
    return next((unit for _, unit in splits if unit in UNITS), "")


def table_speeds(said: Array, unit: str, gyr: Array, name: str) -> Array:
    """Speeds of a table (n,), rad/s without their sign; nan where none is written.

    Parameters
    ----------
    said : (n,) numbers of the column
    unit : that it says, or nothing
    gyr : (n, 3) rad/s
    name : of the file, for messages

    Raises
    ------
    InputError
        If the gyroscopes turn otherwise in any unit.

    """
    bias = np.array([_median(axis) for axis in gyr[said == 0].T])
    seen = np.linalg.norm(gyr - bias, axis=1)
    turning = (np.abs(said) > 0) & np.isfinite(seen) & (seen > 0)
    if not turning.any():
        return np.abs(said) * RATE_UNITS[unit or UNITS[0]]
    ratio = float(np.median(seen[turning] / np.abs(said[turning])))
    for one in (unit,) if unit else UNITS:
        if abs(np.log(ratio / RATE_UNITS[one])) < OFF:
            return np.abs(said) * RATE_UNITS[one]
    raise InputError(
        f"{name}: its gyroscopes turn {ratio / RATE_UNITS[unit or UNITS[0]]:.3g} times"
        f" as fast as its column of the table's rate says in {unit or UNITS[0]}: add"
        " --gyr-unit, or write the unit into the name of that column, as in rate"
        " (deg/s)"
    )


def turned_rows(gyr: Array) -> NDArray[np.bool_]:
    """Rows of rates (n, 3), rad/s, in which a device was turned and did not rest."""
    usual = np.array([_median(axis) for axis in gyr.T])
    usual = np.where(np.linalg.norm(usual) < NO_BIAS, usual, 0.0)
    with np.errstate(invalid="ignore"):
        turned: NDArray[np.bool_] = np.any(
            np.abs(gyr - usual) > np.deg2rad(MOST_AT_REST), axis=1
        )
    return turned


def _median(values: Array) -> float:
    """Median of the numbers (n,) that are known; 0 of none."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else 0.0
