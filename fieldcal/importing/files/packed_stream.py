"""Bytes of a file, unpacked where it is packed, also of one that was cut off.

Packed are a .gz, .bz2 or .xz, and a .zip that holds one file.

What comes before the place where a packed file ends or fails is whole: gzip and xz
check themselves at the end of a part, but no byte before the fault depends on what
follows it.
"""

from __future__ import annotations

import bz2
import io
import lzma
import shutil
import tempfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Protocol

from fieldcal.core.errors import InputError, disk_says
from fieldcal.importing.files import zip_member

HEAD = 4096
"""First bytes by which a format is known."""

PIECE = 1 << 20
"""Bytes that are looked at together."""

_AT_ONCE = 1 << 16
"""Packed bytes read together."""

OnTruncation = Callable[[str, str], None]
"""Called with the place where a file ends too early; may raise."""


class _Unpacker(Protocol):
    """Unpacks one part of a packed file, as those of bz2 and lzma do."""

    @property
    def eof(self) -> bool:
        """Whether the part is over."""

    @property
    def needs_input(self) -> bool:
        """Whether nothing more comes of the bytes that it was given."""

    @property
    def unused_data(self) -> bytes:
        """What it was given behind the end of the part."""

    def decompress(self, data: bytes, max_length: int) -> bytes:
        """Unpack at most so many bytes."""


class _Inflate:
    """Unpacks one part of a gzip file."""

    def __init__(self) -> None:
        self._part, self._kept = zlib.decompressobj(16 + zlib.MAX_WBITS), b""

    @property
    def eof(self) -> bool:
        return self._part.eof

    @property
    def needs_input(self) -> bool:
        return not self._kept

    @property
    def unused_data(self) -> bytes:
        return self._part.unused_data

    def decompress(self, data: bytes, max_length: int) -> bytes:
        out = self._part.decompress(self._kept + data, max_length)
        self._kept = self._part.unconsumed_tail
        return out


UNPACKERS: Mapping[bytes, Callable[[], _Unpacker]] = {
    b"\x1f\x8b": _Inflate,
    **{b"BZh%d1AY&SY" % level: bz2.BZ2Decompressor for level in range(1, 10)},
    b"\xfd7zXZ\x00": lzma.LZMADecompressor,
}
"""By the first bytes of a file."""

LONGEST_MAGIC = max(map(len, (zip_member.MAGIC, *UNPACKERS)))


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
        magic = file.read(LONGEST_MAGIC)
        file.seek(0)
    except FileNotFoundError as error:
        raise InputError(f"{path}: is not there; check its name") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    refuse = refuse_truncated(path)
    raw: io.RawIOBase
    if _is_zip(magic) and (name := zip_member.only_member(path)):
        file.close()
        raw = zip_member.ZipMember(path, name, cut or refuse)
    elif (unpacker := _unpacker_of(magic)) is not None:
        raw = _Unpacked(file, unpacker, refuse, cut or refuse)
    else:
        return file
    return io.BufferedReader(raw, 2 * _AT_ONCE)


def _is_zip(magic: bytes) -> bool:
    return magic.startswith(zip_member.MAGIC)


def _unpacker_of(magic: bytes) -> Callable[[], _Unpacker] | None:
    """What unpacks a file with these first bytes; None if it is not packed."""
    return next((new for at, new in UNPACKERS.items() if magic.startswith(at)), None)


def _name_unpacked(path: Path) -> str | None:
    """Name of the unpacked file; None if a file is not packed."""
    with path.open("rb") as file:
        magic = file.read(LONGEST_MAGIC)
    if _is_zip(magic):
        name = zip_member.only_member(path)
        return name and Path(name).name
    return None if _unpacker_of(magic) is None else path.stem


class _Unpacked(io.RawIOBase):
    """Reader of a packed file, which may have several parts or be truncated."""

    def __init__(
        self,
        file: io.BufferedReader,
        unpacker: Callable[[], _Unpacker],
        nothing: OnTruncation,
        cut: OnTruncation,
    ) -> None:
        self._file, self._nothing, self._cut = file, nothing, cut
        self._unpacker, self._part = unpacker, unpacker()
        self._behind, self._many, self._over = b"", 0, False

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
        packed = self._packed()
        if self._part.eof:
            # zeros between parts and at the end are padding
            packed = packed.lstrip(b"\0")
            if not packed:
                self._over = not self._file.peek(1)
                return b""
            self._part = self._unpacker()
        waited = self._part.needs_input
        try:
            data = self._part.decompress(packed, size)
        except (zlib.error, OSError, lzma.LZMAError) as error:
            self._ends(f"cannot be unpacked ({error})")
            return b""
        self._behind = self._part.unused_data if self._part.eof else b""
        if waited and not packed and not data:
            self._ends("the packed file is cut off")
        return data

    def _packed(self) -> bytes:
        """The next packed bytes; none if those before are not yet used."""
        if self._part.eof or self._part.needs_input:
            behind, self._behind = self._behind, b""
            return behind or self._file.read(_AT_ONCE)
        return b""

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
