"""What a recording from elsewhere is, and which format a file has.

A recording holds the samples of one or several IMUs, each a stream with a name. They
come piece by piece, so that a log may be as long as it likes.
"""

from __future__ import annotations

import gzip
import shutil
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from typing import IO, Any, cast

from fieldcal.description import ACC_UNITS, GYR_UNITS
from fieldcal.errors import InputError, disk_says
from fieldcal.samples import Block

HEAD = 4096
"""First bytes by which a format is known."""

PIECE = 1 << 20
"""Bytes that are looked at together."""

ROWS = 1 << 15
"""Rows that are looked at together."""

MOST = 12
"""Faults of a file that are listed one by one."""

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}

LAST = ("csv_like", "wire")
"""Formats without a mark of their own, tried last, in this order."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What the user says of a file that does not say it itself.

    Attributes
    ----------
    columns : what each column is, or ``t=name`` pairs for columns that have names
    rate_hz : where there is no time
    separator, skip : of text files
    acc_unit, gyr_unit, time_unit : of the file; "" is not said, and SI
    acc_lsb, gyr_lsb : counts in one unit, for raw counts
    options : as in a device's address, ``name=value&name=value``

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

    @property
    def acc_scale(self) -> float:
        """SI units (or counts, volts) in one of the file's."""
        return _unit(self.acc_unit or "m/s^2", ACC_UNITS) / self.acc_lsb

    @property
    def gyr_scale(self) -> float:
        """SI units (or counts, volts) in one of the file's."""
        return _unit(self.gyr_unit or "rad/s", GYR_UNITS) / self.gyr_lsb

    @property
    def time_scale(self) -> float:
        """Seconds in one of the file's unit of time."""
        return _unit(self.time_unit or "s", TIME_UNITS)


def _unit(unit: str, known: dict[str, float]) -> float:
    if unit not in known:
        raise InputError(f"unit {unit!r} is none of: {', '.join(known)}")
    return known[unit]


@dataclass(frozen=True, slots=True)
class Stream:
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

    """

    def __init__(self, path: Path, wanted: Wanted, repair: bool = False) -> None:
        self.path, self.wanted, self.repair = path, wanted, repair
        modules, extra = self.needs()
        if missing := [m for m in modules if find_spec(m) is None]:
            raise InputError(
                f"{path}: reading it needs {' and '.join(missing)}: "
                f"pip install 'fieldcal[{extra}]'"
            )
        self.says: list[str] = []
        self.mended: list[str] = []
        self._more = 0

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Modules that reading it takes, and the extra of fieldcal that brings them."""
        return (), ""

    @abstractmethod
    def streams(self) -> list[Stream]:
        """The IMUs in it."""

    @abstractmethod
    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of one of them in the order of the file, SI units, device axes."""

    def notes(self, stream: str) -> dict[str, Any]:
        """What the file says of the device: units, what it has installed."""
        return {}

    def place(self, row: int) -> str:
        """Name a sample, counted from 0, as its file does."""
        return f"row {row + 1}"

    def damaged(self, where: str, what: str) -> None:
        """Refuse a damaged place, or take note that it was left out.

        Raises
        ------
        InputError
            Where the user did not ask for a repair.

        """
        if not self.repair:
            raise InputError(
                f"{self.path}: {where}: {what}; copy the file again, or leave such"
                " places out with --repair"
            )
        if len(self.mended) < MOST:
            self.mended.append(f"{where}: {what}, left out")
            self._more = 0
            return
        self._more += 1
        self.mended[MOST:] = [f"{self._more} more damaged places, left out"]


def unpacked(path: Path) -> IO[bytes]:
    """Open a file for reading, also .gz.

    Raises
    ------
    InputError
        If it cannot be opened.

    """
    try:
        file = path.open("rb")
        magic = file.read(2)
        file.seek(0)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if magic != b"\x1f\x8b":
        return file
    file.close()
    return cast(IO[bytes], gzip.open(path, "rb"))


def pieces(path: Path, size: int = PIECE) -> Iterator[bytes]:
    """Bytes of a file, unpacked, piece by piece.

    Raises
    ------
    InputError
        If it cannot be read, or unpacked.

    """
    with unpacked(path) as file:
        at = 0
        while True:
            try:
                data = file.read(size)
            except (OSError, EOFError, ValueError) as error:
                raise InputError(
                    f"{path}: cannot be read behind byte {at}: {error}"
                ) from error
            except Exception as error:
                # zlib has an error of its own, of no common kind
                raise InputError(
                    f"{path}: cannot be unpacked behind byte {at}: {error}"
                ) from error
            if not data:
                return
            at += len(data)
            yield data


@contextmanager
def on_disk(path: Path) -> Iterator[Path]:
    """Give a file that can be searched, unpacked where it was not."""
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
    if not packed:
        yield path
        return
    folder = Path(tempfile.mkdtemp(prefix="fieldcal."))
    try:
        whole = folder / path.stem
        try:
            with whole.open("wb") as out:
                for data in pieces(path):
                    out.write(data)
        except OSError as error:
            raise InputError(
                f"{path}: cannot be unpacked into {folder.parent}: {disk_says(error)},"
                " by the environment's TMPDIR"
            ) from error
        yield whole
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def formats() -> list[str]:
    """Names of the formats there are, those with a mark of their own first."""
    from fieldcal import importers

    names = sorted(module.name for module in iter_modules(importers.__path__))
    return [*(n for n in names if n not in LAST), *LAST]


def open_recording(
    path: Path, wanted: Wanted, name: str = "", repair: bool = False
) -> Recording:
    """Open a file by its content.

    Parameters
    ----------
    path : also .gz
    wanted : what the user says of it
    name : its format, if it is not to be found
    repair : whether damaged places are left out and said, or refused

    Raises
    ------
    InputError
        If it cannot be read, or nothing knows its format.

    """
    if name and name not in formats():
        raise InputError(f"no format {name!r}: there are {', '.join(formats())}")
    head = b"".join(pieces_of_head(path))
    if not head:
        raise InputError(f"{path}: is empty; copy it again from where it came")
    for some in [name] if name else formats():
        module = import_module(f"fieldcal.importers.{some}")
        if name or module.recognises(head, path):
            opened: Recording = module.File(path, wanted, repair)
            return opened
    raise InputError(
        f"{path}: is of no format that is known by its content: name one with --format"
        f" {'|'.join(formats())}"
    )


def pieces_of_head(path: Path) -> Iterator[bytes]:
    """First bytes of a file, unpacked."""
    for data in pieces(path, HEAD):
        yield data
        return
