"""Replacements for letters that a terminal cannot show.

A Windows console with code page 1252 has ± and ° but no α. Such letters are spelled
out, so that no sentence is lost and no command fails.
"""

from __future__ import annotations

import codecs
import sys

SPELLINGS = {
    "α": "alpha", "β": "beta", "σ": "sigma", "χ": "chi", "Δ": "d", "√": "sqrt ",
    "→": "->", "←": "<-", "≤": "<=", "≥": ">=", "−": "-", "²": "^2", "³": "^3",
    "±": "+-", "°": " deg", "·": ".", "–": "-", "…": "...", "█": "#", "░": ":",
}  # fmt: skip
"""By letter. Others become a question mark, lines of boxes a plus or a dash."""

BOX_CHARACTERS = range(0x2500, 0x2580)
HORIZONTAL = "─━═╌┄"

ERROR_HANDLER = "fieldcal.spelled"


def spell_unencodable(error: UnicodeError) -> tuple[str, int]:
    """Error handler for `codecs`: replacements for letters that cannot be encoded."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    return "".join(map(_spell_letter, text)), error.end


def spell(text: str, encoding: str) -> str:
    """Text with replacements for the letters that an encoding does not have.

    >>> spell("± 1σ", "cp1252"), spell("± 1σ", "utf-8")
    ('± 1sigma', '± 1σ')
    """
    codecs.register_error(ERROR_HANDLER, spell_unencodable)
    return text.encode(encoding, ERROR_HANDLER).decode(encoding)


def _spell_letter(letter: str) -> str:
    if letter in SPELLINGS:
        return SPELLINGS[letter]
    if ord(letter) in BOX_CHARACTERS:
        return "-" if letter in HORIZONTAL else "+"
    return "?"


def use_spellings() -> None:
    """Make the standard streams spell letters that their encoding does not have."""
    codecs.register_error(ERROR_HANDLER, spell_unencodable)
    for stream in (sys.stdout, sys.stderr):
        encoding = getattr(stream, "encoding", None) or "utf-8"
        change = getattr(stream, "reconfigure", None)
        if change and not encoding.lower().replace("-", "").startswith("utf"):
            change(errors=ERROR_HANDLER)
