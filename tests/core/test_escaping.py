"""Text of others: what is not to be seen is shown by its number, and all else stays."""

from __future__ import annotations

import io
import unicodedata

import pytest

from fieldcal.core.escaping import EscapingStream, escape_invisible, escape_line


@pytest.mark.parametrize(
    ("text", "seen"),
    [
        ("\x1b[2J", r"\x1b[2J"),
        ("\x07\x7f\x9b", r"\x07\x7f\x9b"),
        ("a\u202eb\u200bc", r"a\u202eb\u200bc"),
        ("\u2028\U000e0001", r"\u2028\U000e0001"),
        ("\ud800", r"\ud800"),
        ("α = 45°, 测量, é", "α = 45°, 测量, é"),
        ("two\nlines\tand a tab", "two\nlines\tand a tab"),
        (r"C:\x1b", r"C:\x1b"),
    ],
)
def test_what_is_not_to_be_seen_has_its_number(text: str, seen: str) -> None:
    assert escape_invisible(text) == seen


def test_nothing_that_a_terminal_obeys_is_left_of_any_character() -> None:
    text = escape_invisible("".join(map(chr, range(0x3000))))
    assert {c for c in text if unicodedata.category(c)[0] == "C"} == {"\n", "\t"}


def test_a_name_cannot_begin_a_line_or_a_column() -> None:
    assert escape_line("left\nGO\t5\r") == r"left\x0aGO\x095\x0d"
    assert escape_line("α = 45°") == "α = 45°"


def test_a_stream_shows_what_is_written_and_is_itself_otherwise() -> None:
    below = io.StringIO()
    stream = EscapingStream(below)
    assert stream.write("\x07GO\n") == len("\\x07GO\n")
    stream.writelines(["\x1b", "a"])
    assert stream.getvalue() == "\\x07GO\n\\x1ba"
