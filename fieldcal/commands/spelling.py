"""What a terminal of few letters is sent in place of those it lacks.

A Windows console with code page 1252 has ± and ° and no α; what it cannot show is
spelled, so that no sentence is lost and no command ends for the sake of a letter.
"""

from __future__ import annotations

import codecs
import sys

SPELLED = {
    "α": "alpha", "β": "beta", "σ": "sigma", "χ": "chi", "Δ": "d", "√": "sqrt ",
    "→": "->", "←": "<-", "≤": "<=", "≥": ">=", "−": "-", "²": "^2", "³": "^3",
    "±": "+-", "°": " deg", "·": ".", "–": "-", "…": "...", "█": "#", "░": ":",
}  # fmt: skip
"""By letter; others become a question mark, lines of boxes a plus or a dash."""

BOXES = range(0x2500, 0x2580)
FLAT = "─━═╌┄"

NAME = "fieldcal.spelled"


def spelled(error: UnicodeError) -> tuple[str, int]:
    """What stands for letters that cannot be encoded, as `codecs` asks for it."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    return "".join(map(_one, text)), error.end


def _one(letter: str) -> str:
    if letter in SPELLED:
        return SPELLED[letter]
    if ord(letter) in BOXES:
        return "-" if letter in FLAT else "+"
    return "?"


def spell_out() -> None:
    """Have the standard streams spell what their terminal cannot show."""
    codecs.register_error(NAME, spelled)
    for stream in (sys.stdout, sys.stderr):
        encoding = getattr(stream, "encoding", None) or "utf-8"
        change = getattr(stream, "reconfigure", None)
        if change and not encoding.lower().replace("-", "").startswith("utf"):
            change(errors=NAME)
