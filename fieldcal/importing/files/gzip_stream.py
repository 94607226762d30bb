"""Bytes of a file, unpacked where it is packed, also of one that was cut off.

Packed are a .gz, and a .zip that holds one file.

What comes before the place where a packed file ends or fails is whole: gzip checks
itself only at its end, but no byte before the fault depends on what follows it.
"""

from __future__ import annotations

import io
import shutil
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from fieldcal.core.errors import InputError, disk_says
from fieldcal.importing.files import zip_member

HEAD = 4096
"""First bytes by which a format is known."""

PIECE = 1 << 20
"""Bytes that are looked at together."""

MAGIC = b"\x1f\x8b"

_AT_ONCE = 1 << 16
"""Packed bytes read together."""

OnTruncation = Callable[[str, str], None]
"""Called with the place where a file ends too early; may raise."""


def refuse_truncated(path: Path) -> OnTruncation:
    """Refuse a file that ends too early."""

    def cut(where: str, what: str) -> None:
        raise InputError(f"{path}: {where}: {what}; copy it again from where it came")

    return cut


def open_unpacked(path: Path, cut: OnTruncation | None = None) -> IO[bytes]:
    """Open a file for reading, unpacked.

    Parameters
    ----------
    path : the file
    cut : called if a packed file ends too early; without it that is an error

    Raises
    ------
    InputError
        If it cannot be opened, or nothing of it be unpacked.

    """
    try:
        file = path.open("rb")
        magic = file.read(len(zip_member.MAGIC))
        file.seek(0)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    refuse = refuse_truncated(path)
    raw: io.RawIOBase
    if magic == zip_member.MAGIC and (name := zip_member.only_member(path)):
        file.close()
        raw = zip_member.ZipMember(path, name, cut or refuse)
    elif magic.startswith(MAGIC):
        raw = _Gunzip(file, refuse, cut or refuse)
    else:
        return file
    return io.BufferedReader(raw, 2 * _AT_ONCE)


def _name_unpacked(path: Path) -> str | None:
    """Name of the unpacked file; None if a file is not packed."""
    with path.open("rb") as file:
        magic = file.read(len(zip_member.MAGIC))
    if magic == zip_member.MAGIC:
        name = zip_member.only_member(path)
        return name and Path(name).name
    return path.stem if magic.startswith(MAGIC) else None


class _Gunzip(io.RawIOBase):
    """Reader of a gzip file, which may have several parts or be truncated."""

    def __init__(
        self, file: io.BufferedReader, nothing: OnTruncation, cut: OnTruncation
    ) -> None:
        self._file, self._nothing, self._cut = file, nothing, cut
        self._part = zlib.decompressobj(16 + zlib.MAX_WBITS)
        self._packed, self._many, self._over = b"", 0, False

    def readable(self) -> bool:
        """Say that it can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer as far as the next packed bytes do."""
        data = b""
        while not data and not self._over:
            data = self._next(len(buffer))
        buffer[: len(data)] = data
        self._many += len(data)
        return len(data)

    def _next(self, size: int) -> bytes:
        packed = self._packed or self._file.read(_AT_ONCE)
        if self._part.eof:
            # zeros between parts and at the end are padding
            packed = packed.lstrip(b"\0")
            if not packed:
                self._packed, self._over = b"", not self._file.peek(1)
                return b""
            self._part = zlib.decompressobj(16 + zlib.MAX_WBITS)
        try:
            data = self._part.decompress(packed, size)
        except zlib.error as error:
            self._ends(f"cannot be unpacked ({error})")
            return b""
        self._packed = self._part.unconsumed_tail or self._part.unused_data
        if not packed and not data:
            self._ends("the packed file is cut off")
        return data

    def _ends(self, what: str) -> None:
        self._over = True
        cut = self._cut if self._many else self._nothing
        cut(f"behind byte {self._many}, unpacked", what)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()


def unpacked_pieces(
    path: Path, size: int = PIECE, cut: OnTruncation | None = None
) -> Iterator[bytes]:
    """Bytes of a file, unpacked, piece by piece.

    Raises
    ------
    InputError
        If it cannot be read, or not be unpacked where `cut` refuses that.

    """
    with open_unpacked(path, cut) as file:
        at = 0
        while True:
            try:
                data = file.read(size)
            except OSError as error:
                raise InputError(
                    f"{path}: cannot be read behind byte {at}: {error}"
                ) from error
            if not data:
                return
            at += len(data)
            yield data


def first_bytes(path: Path, many: int = HEAD) -> bytes:
    """First bytes of a file, unpacked; fewer if the file is shorter."""
    return next(unpacked_pieces(path, many, lambda where, what: None), b"")


@contextmanager
def unpacked_file(path: Path, cut: OnTruncation | None = None) -> Iterator[Path]:
    """Return an unpacked file that supports seeking."""
    name = _name_unpacked(path)
    if name is None:
        yield path
        return
    folder = Path(tempfile.mkdtemp(prefix="fieldcal."))
    try:
        whole = folder / name
        try:
            with whole.open("wb") as out:
                for data in unpacked_pieces(path, cut=cut):
                    out.write(data)
        except OSError as error:
            raise InputError(
                f"{path}: cannot be unpacked into {folder.parent}: {disk_says(error)},"
                " by the environment's TMPDIR"
            ) from error
        yield whole
    finally:
        shutil.rmtree(folder, ignore_errors=True)
