"""A recording of another program.

A recording holds the samples of one or several IMUs, each a stream with a name. They
come piece by piece, so that a log may be as long as it likes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.files.gzip_stream import PIECE, unpacked_pieces
from fieldcal.session.units import ACC_UNITS, GYR_UNITS

ROWS = 1 << 15
"""Rows that are looked at together."""

MAX_LISTED_FAULTS = 12
"""Faults of a file that are listed one by one."""

MAX_READING = 1e12
"""Beyond every reading in SI units, and every count of 32 bits."""

TEMP_UNITS = {
    "degC": (1.0, 0.0),
    "cdegC": (0.01, 0.0),
    "K": (1.0, -273.15),
    "degF": (5 / 9, -160 / 9),
    "none": (np.nan, np.nan),
}
"""Kelvin in one of each, and deg C at its 0; "none" leaves it out."""

FORCE_UNITS = ACC_UNITS | {"ug": 1e-6 * G0, "mm/s^2": 1e-3, "cm/s^2": 1e-2}
RATE_UNITS = GYR_UNITS | {
    "mdeg/s": 1e-3 * GYR_UNITS["deg/s"],
    "udeg/s": 1e-6 * GYR_UNITS["deg/s"],
    "deg/h": GYR_UNITS["deg/s"] / 3600,
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


class MeanScatter(NamedTuple):
    """Scatter of the samples behind means, as a table states it.

    Attributes
    ----------
    means : (n, 6) in units of the table, of all its rows; nan where not written
    values : (n, 6) likewise
    many : (n,) samples of each mean; None where not written
    timed : whether the table says when each was taken

    """

    means: Array
    values: Array
    many: Array | None
    timed: bool


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
    free : whether the names of accelerations are those of ones without gravity

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
    free: bool = False
    acc_zero: tuple[float, ...] = ()

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
        return _unit(self.time_unit or "s", TIME_UNITS)

    @property
    def celsius(self) -> tuple[float, float]:
        """Kelvin in one of the file's unit of temperature, and deg C at its 0."""
        own = {"count": (1 / self.temp_lsb, self.temp_zero)}
        name = self.temp_unit or "degC"
        if name not in (known := TEMP_UNITS | own):
            raise InputError(f"unit {name!r} is none of: {', '.join(known)}")
        return known[name]


def _unit(unit: str, known: dict[str, float]) -> float:
    if unit not in known:
        raise InputError(f"unit {unit!r} is none of: {', '.join(known)}")
    return known[unit]


@dataclass(frozen=True, slots=True)
class ImuStream:
    """One IMU of a recording.

    Attributes
    ----------
    name : by which it is chosen
    says : what it is and in which units, a line

    """

    name: str
    says: str


class Recording(ABC):
    """A file, opened.

    Attributes
    ----------
    says : what the user must know, one sentence each; grows while it is read
    mended : what was left out because it was damaged, grows likewise
    guessed : what was taken for what nobody said, and why, by what it is
    ends_early : whether it was cut off, as far as it was read
    began : stamp of the first row, s, where times count from that row; nan if unknown
    columns_said : whether the user said what its columns are
    sensor : what bare axes are of, where something else than the file says it
    lacks_gravity : whether gravity, which another file holds, is added to its forces

    """

    ends_early = lacks_gravity = False
    first_days: tuple[int, ...] = ()
    """Days, counted from the year 1, that its clock may count from."""

    later = 0.0
    """Added to times by its clock, s: where it counts from another day than others."""

    sensor = ""
    began = float("nan")
    from_first = True
    """Whether times count from the first row, of formats whose zero says nothing."""

    asks_units = False
    """Whether units are the user's to say; other formats say them."""

    def __init__(self, path: Path, wanted: ReadOptions, repair: bool = False) -> None:
        self.path, self.wanted, self.repair = path, wanted, repair
        self.columns_said = bool(wanted.columns)
        modules, extra = self.needs()
        if missing := [m for m in modules if find_spec(m) is None]:
            raise InputError(
                f"{path}: reading it needs {' and '.join(missing)}: "
                f"pip install 'fieldcal[{extra}]'"
            )
        self.says: list[str] = []
        self.mended: list[str] = []
        self.guessed: dict[str, str] = {}
        self._more = 0

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Modules that reading it takes, and the extra of fieldcal that brings them."""
        return (), ""

    @abstractmethod
    def streams(self) -> list[ImuStream]:
        """The IMUs in it."""

    @abstractmethod
    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of one of them in the order of the file, SI units, device axes."""

    @property
    def parts(self) -> list[Recording]:
        """The files of which it is made up."""
        return [self]

    def first_rows(self, stream: str, most: int) -> Block:
        """Rows at its beginning, so many at most."""
        blocks: list[Block] = []
        for block in self.blocks(stream):
            blocks.append(block)
            if sum(map(len, blocks)) >= most:
                break
        return concat(blocks)[:most]

    def alone(self, stream: str) -> Recording:
        """The recording with what is said of one of its IMUs alone."""
        one = copy(self)
        one.says, one.mended = list(self.says), list(self.mended)
        one.guessed = dict(self.guessed)
        return one

    def notes(self, stream: str) -> dict[str, Any]:
        """What the file says of the device: units, what it has installed."""
        return {}

    def scatter(self) -> MeanScatter | None:
        """What the file says of the scatter behind its rows; None if they are samples.

        Rows that are means are one for each position.
        """
        return None

    def rescaled(self, acc: float, gyr: float) -> str:
        """Options under which outputs read so many times less; "" if there are none."""
        return ""

    def files(self) -> list[Path]:
        """The files that it is read from."""
        return [self.path]

    def place(self, row: int) -> str:
        """Name a sample, counted from 0, as its file does."""
        return f"row {row + 1}"

    def pieces(self, size: int = PIECE) -> Iterator[bytes]:
        """Bytes of the file, unpacked, up to where it was cut off."""
        return unpacked_pieces(self.path, size, self.cut_off)

    def cut_off(self, where: str, what: str) -> None:
        """Refuse a file that ends too early, or be content with what comes before.

        Raises
        ------
        InputError
            Where the user did not ask for a repair.

        """
        self._refuse(where, what, "take what is whole before that")
        self.ends_early = True
        sentence = f"{where}: {what}; what was whole before that is taken"
        if sentence not in self.mended:
            self.mended.insert(0, sentence)

    def _refuse(self, where: str, what: str, mend: str) -> None:
        """Raise, unless the user asked for a repair."""
        if not self.repair:
            raise InputError(
                f"{self.path}: {where}: {what}; copy the file again, or {mend} with"
                " --repair"
            )

    def damaged(self, where: str, what: str) -> None:
        """Refuse a damaged place, or take note that it was left out.

        Raises
        ------
        InputError
            Where the user did not ask for a repair.

        """
        self._refuse(where, what, "leave such places out")
        if len(self.mended) < MAX_LISTED_FAULTS:
            self.mended.append(f"{where}: {what}, left out")
            self._more = 0
            return
        self._more += 1
        self.mended[MAX_LISTED_FAULTS:] = [
            f"{self._more} more damaged places, left out"
        ]
