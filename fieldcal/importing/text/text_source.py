"""Whole lines of a text file as UTF-8, with what must be undone before columns.

The text may be a file of a .zip or of a folder. Lines come many at a time, so that a
log may be as long as it likes.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from zipfile import BadZipFile, ZipFile

from fieldcal.core.errors import InputError
from fieldcal.importing.files.packed_stream import PIECE, unpacked_pieces
from fieldcal.importing.files.text_encoding import as_utf8
from fieldcal.importing.recording import Recording
from fieldcal.importing.text.text_form import TextForm
from fieldcal.importing.text.text_lines import split_lines, top_lines

AT_ONCE = 1 << 12
"""Lines whose forms are undone at once: who looks at the top need not wait for more."""


FILL = b"\0\xff"
"""What fills the end of a file that a device made longer than it needed."""


class TextSource:
    """Lines of a text.

    Parameters
    ----------
    recording : whose file it is
    member : the file of a .zip or folder that is the text; "" if it is the file itself

    """

    def __init__(self, recording: Recording, member: str) -> None:
        self._recording, self._member = recording, member

    def top(self) -> list[str]:
        """First lines, as they stand in the file."""
        return next((top_lines(data) for data in self._whole_lines()), [])

    def pieces(self, forms: Sequence[TextForm]) -> Iterator[bytes]:
        """Whole lines, many at a time, with these forms undone."""
        readers = [form.reader() for form in forms]
        for data in self._whole_lines():
            if not readers:
                yield data
                continue
            whole = split_lines(data)
            for first in range(0, len(whole), AT_ONCE):
                lines = whole[first : first + AT_ONCE]
                for read in readers:
                    # no lines at all would be the end of the text
                    lines = read(lines) if lines else []
                if lines:
                    yield ("\n".join(lines) + "\n").encode()
        lines = []
        for read in readers:
            lines = [*(read(lines) if lines else []), *read([])]
        if lines:
            yield ("\n".join(lines) + "\n").encode()

    def _whole_lines(self) -> Iterator[bytes]:
        """Whole lines of the file as UTF-8, many at a time."""
        rest = b""
        for data in as_utf8(self._bytes()):
            end = data.rfind(b"\n") + 1
            if not end:
                # what fills a file may be as long as the rest of it
                rest += data if data.strip(FILL) else data[:1]
                continue
            # one copy: there may be gigabytes of them
            whole, rest = b"".join((rest, memoryview(data)[:end])), data[end:]
            if not whole.isspace():
                yield _with_line_feeds(whole)
        if rest.endswith((FILL[:1], FILL[1:])):
            self._say_filled()
        # a number that was cut off is another number
        elif rest.strip() and not self._recording.ends_early:
            # a file without a line feed may have the other kind of ends of lines
            yield rest.replace(b"\r", b"\n")

    def _say_filled(self) -> None:
        """Say that a device had not filled the file that it had made beforehand."""
        said = (
            "behind its last whole line it is filled with bytes that hold nothing, as"
            " where a device makes a file before it writes into it: they are left out"
        )
        self._recording.says += [said] if said not in self._recording.says else []

    def _bytes(self) -> Iterator[bytes]:
        """Bytes of the text, unpacked."""
        if not self._member:
            yield from self._recording.pieces()
            return
        path = self._recording.path
        if path.is_dir():
            yield from unpacked_pieces(
                path / self._member, PIECE, self._recording.cut_off
            )
            return
        try:
            with ZipFile(path) as archive, archive.open(self._member) as file:
                while data := file.read(PIECE):
                    yield data
        except (BadZipFile, OSError, RuntimeError, zlib.error, EOFError) as error:
            raise InputError(
                f"{path}: {self._member} cannot be read: {error}; copy it again from"
                " where it came"
            ) from error


def _with_line_feeds(lines: bytes) -> bytes:
    r"""Whole lines with a line feed at the end of each, where some have another sign.

    >>> _with_line_feeds(b"1,2\r3,4\r\n"), _with_line_feeds(b"1,2\r\n")
    (b'1,2\n3,4\n', b'1,2\r\n')
    """
    if lines.count(b"\r") == lines.count(b"\r\n"):
        return lines
    return lines.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
