"""What the user says of a file that does not say it itself: columns, units, times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.importing.words.tick_units import tick_seconds
from fieldcal.session.units import ACC_UNITS, GYR_UNITS

TEMP_UNITS = {
    "degC": (1.0, 0.0),
    "cdegC": (0.01, 0.0),
    "mdegC": (0.001, 0.0),
    "ddegC": (0.1, 0.0),
    "K": (1.0, -273.15),
    "degF": (5 / 9, -160 / 9),
    "none": (np.nan, np.nan),
}
"""Kelvin in one of each, and deg C at its 0; "none" leaves it out."""

FOOT_M = 0.3048
"""The international foot, of which an inch is a twelfth."""

FORCE_UNITS = ACC_UNITS | {
    "ug": 1e-6 * G0,
    "mm/s^2": 1e-3,
    "cm/s^2": 1e-2,
    "ft/s^2": FOOT_M,
    "in/s^2": FOOT_M / 12,
}
RATE_UNITS = GYR_UNITS | {
    "mdeg/s": 1e-3 * GYR_UNITS["deg/s"],
    "udeg/s": 1e-6 * GYR_UNITS["deg/s"],
    "deg/h": GYR_UNITS["deg/s"] / 3600,
    "urad/s": 1e-6,
    "rev/s": 2 * np.pi,
    "rpm": 2 * np.pi / 60,
}
"""SI units (or counts, volts) in one of each that a file may be in."""

TIME_UNITS = {
    "s": 1.0,
    "ms": 1e-3,
    "0.1ms": 1e-4,
    "39.0625us": 39.0625e-6,
    "us": 1e-6,
    "ns": 1e-9,
    "100ns": 1e-7,
    "min": 60.0,
    "h": 3600.0,
    "d": 86400.0,
    "hhmmss": 1.0,
}

CLOCK_NUMBER = "hhmmss"
"""Unit of times such as 142031.5, which is 14:20:31.5."""


class RowBatch(NamedTuple):
    """Batches of rows that share a time: interval in s, and rows per batch."""

    seconds: float
    rows: float


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """Options of the user for what a file does not state.

    Attributes
    ----------
    columns : what each column is, or ``t=name`` pairs for columns that have names
    rate_hz : where there is no time
    separator, skip : of text files
    acc_unit, gyr_unit, time_unit : of the file; "" is not said, and SI
    acc_lsb, gyr_lsb : counts in one unit, for raw counts
    acc_zero : x y z of the file's numbers at no acceleration; () is not said
    temp_unit : of the file; "" is not said, and degC
    temp_lsb, temp_zero : counts in 1 K, and deg C at count 0
    options : as in a device's address, ``name=value&name=value``
    named : kinds of channel (a, g, t) whose unit the file's headings say
    unsigned : kinds of channel (a, g) in 16 bits of which the sign was not read
    reversed : channels whose axis points the other way in the file
    batch : rows that share a time, where they do
    tick : step of a clock too coarse for its rows, in its unit; 0 of others
    written_again : whether each of them was written several times
    usual : unit of rates that such names of columns have; "" where they tell none
    usual_acc : the same of accelerations
    cut : whether the numbers are whole ones, cut toward zero
    free : whether the names of accelerations are those of ones without gravity
    no_gain : whether names say accelerations, and so no gains of velocity
    means : whether rows are means, of which the user says how well they are known

    """

    columns: tuple[str, ...] = ()
    rate_hz: float | None = None
    separator: str | None = None
    skip: int | None = None
    acc_unit: str = ""
    gyr_unit: str = ""
    time_unit: str = ""
    acc_lsb: float = 1.0
    gyr_lsb: float = 1.0
    options: str = ""
    temp_unit: str = ""
    temp_lsb: float = 1.0
    temp_zero: float = 0.0
    named: frozenset[str] = frozenset()
    unsigned: frozenset[str] = frozenset()
    reversed: frozenset[str] = frozenset()
    batch: RowBatch | None = None
    tick: float = 0.0
    written_again: bool = False
    usual: str = ""
    usual_acc: str = ""
    cut: bool = False
    free: bool = False
    no_gain: bool = False
    acc_zero: tuple[float, ...] = ()
    means: bool = False

    @property
    def acc_scale(self) -> float:
        """SI units (or counts, volts) in one of the file's."""
        return _unit(self.acc_unit or "m/s^2", FORCE_UNITS) / self.acc_lsb

    @property
    def zero(self) -> Array:
        """The file's numbers at no acceleration, (3,), of the axes that are taken."""
        signs = [-1.0 if f"a{axis}" in self.reversed else 1.0 for axis in "xyz"]
        return np.multiply(signs, self.acc_zero or 0.0)

    @property
    def gyr_scale(self) -> float:
        """SI units (or counts, volts) in one of the file's."""
        return _unit(self.gyr_unit or "rad/s", RATE_UNITS) / self.gyr_lsb

    @property
    def time_scale(self) -> float:
        """Seconds in one of the file's unit of time."""
        return seconds_in(self.time_unit or "s")

    @property
    def celsius(self) -> tuple[float, float]:
        """Kelvin in one of the file's unit of temperature, and deg C at its 0."""
        own = {"count": (1 / self.temp_lsb, self.temp_zero)}
        name = self.temp_unit or "degC"
        if name not in (known := TEMP_UNITS | own):
            raise InputError(f"unit {name!r} is none of: {', '.join(known)}")
        return known[name]


def seconds_in(unit: str) -> float:
    """Seconds in one of a unit of time, which may be so many of another: 31.25us.

    Raises
    ------
    InputError
        If it is none.

    """
    if unit in TIME_UNITS:
        return TIME_UNITS[unit]
    if (seconds := tick_seconds(unit)) is None:
        raise InputError(
            f"unit {unit!r} is none of: {', '.join(TIME_UNITS)}; and it is not so many"
            " of one, such as 31.25us or 1/32768s"
        )
    return seconds


def _unit(unit: str, known: dict[str, float]) -> float:
    if unit not in known:
        raise InputError(f"unit {unit!r} is none of: {', '.join(known)}")
    return known[unit]
