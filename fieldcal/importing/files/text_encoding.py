"""Bytes of a text as UTF-8.

Texts come in UTF-8, with a mark before it or without, in UTF-16 of either order, and in
the code page 1252 of older Windows programs.
"""

from __future__ import annotations

import codecs
from collections.abc import Iterable, Iterator

MARK = b"\xef\xbb\xbf"
"""What some programs write before UTF-8."""

UTF16_MARKS = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
"""What UTF-16 begins with, where it has a mark."""

HALF = 0.45
"""Share of the bytes of a text in UTF-16 that are 0, all in the same half of each."""

SIGNS = "°²µ".encode("cp1252")
"""Signs of units that stand in every line of a log."""

PLAIN = bytes([*range(32, 127), *b"\t\r\n", *SIGNS])
"""Characters of a text."""

LETTERS = PLAIN + bytes(range(128, 256))
"""Bytes of a text in UTF-8."""

TEXT = 0.95
"""Share of them that a text has among its first bytes."""

LOOKED = 4096
"""First bytes by which the encoding is told."""


def is_mostly_text(head: bytes) -> bool:
    """Whether most bytes are printable characters.

    >>> is_mostly_text("Gx=0.6 °/s 🌐 角速度".encode())
    True
    >>> is_mostly_text(bytes(range(256)))
    False
    """
    others = (1 - TEXT) * len(head)
    if len(head.translate(None, delete=PLAIN)) <= others:
        return True
    # what no byte of UTF-8 contradicts is UTF-8; the last letter may be cut off
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return False
    return len(head.translate(None, delete=LETTERS)) <= others


def utf16_encoding(head: bytes) -> str | None:
    """Return the UTF-16 in which a text begins, as Python calls it; None of another.

    >>> utf16_encoding("t,ax".encode("utf-16-be")), utf16_encoding(b"t,ax")
    ('utf-16-be', None)
    """
    marked = UTF16_MARKS.get(head[:2])
    head = head[2 if marked else 0 : len(head) // 2 * 2]
    for name, zeros, letters in (
        ("utf-16-le", head[1::2], head[::2]),
        ("utf-16-be", head[::2], head[1::2]),
    ):
        empty = zeros.count(0) >= 2 * HALF * len(zeros)
        if empty and is_mostly_text(letters) and marked in (None, name):
            return name if head else None
    return None


def as_utf8(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """Convert the bytes of a text to UTF-8."""
    decoder: codecs.IncrementalDecoder | None = None
    for number, data in enumerate(pieces):
        if not number:
            name = utf16_encoding(data[:LOOKED])
            decoder = codecs.getincrementaldecoder(name)("replace") if name else None
            data = data if decoder else data.removeprefix(MARK)
        yield decoder.decode(data).lstrip("\ufeff").encode() if decoder else data
