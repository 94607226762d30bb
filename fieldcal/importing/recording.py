"""A recording of another program.

A recording holds the samples of one or several IMUs, each a stream with a name. They
come piece by piece, so that a log may be as long as it likes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.files.packed_stream import PIECE, unpacked_pieces
from fieldcal.importing.read_options import ReadOptions

ROWS = 1 << 15
"""Rows that are looked at together."""

MAX_LISTED_FAULTS = 12
"""Faults of a file that are listed one by one."""

MAX_READING = 1e12
"""Beyond every reading in SI units, and every count of 32 bits."""


class MeanScatter(NamedTuple):
    """Scatter of the samples behind means, as a table states it.

    Attributes
    ----------
    means : (n, 6) in units of the table, of all its rows; nan where not written
    values : (n, 6) likewise
    many : (n,) samples of each mean; None where not written
    timed : whether the table says when each was taken
    speeds : (n,) rate of the table that turned the device, in `speed_unit`; None where
        not written
    speed_unit : that the table says, or nothing

    """

    means: Array
    values: Array
    many: Array | None
    timed: bool
    speeds: Array | None = None
    speed_unit: str = ""


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

    def sentence(self) -> str:
        """Name and line; a number that only counts IMUs is no name.

        >>> ImuStream("0", "columns in g").sentence()
        'columns in g'
        >>> ImuStream("IMU.0", "calibrated").sentence()
        'IMU.0, calibrated'
        """
        return self.says if self.name == "0" else f"{self.name}, {self.says}"


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

    def row_sigma(self, gravity: float) -> float | None:
        """Standard deviation of its rows, m/s^2, if each may be taken for a position.

        None where gravity, m/s^2, is not all that its accelerometers feel.
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

    @contextmanager
    def named_errors(self) -> Iterator[None]:
        """Name the file in what is wrong with what it holds."""
        try:
            yield
        except InputError as error:
            raise InputError(f"{self.path}: {error}") from error

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
