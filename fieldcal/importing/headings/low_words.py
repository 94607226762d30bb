"""Lower halves of words of 32 bits, which programs write as columns of their own.

``XGYRO_LOW`` beside ``XGYRO_OUT``: registers of the sensors of Analog Devices, whose
user registers hold 16 bits each (their data sheets, such as ADIS16495's, say that the
one of LOW extends that of OUT). A rate or force is in OUT; LOW alone is no number.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.importing.headings.best_columns import NamedColumn

HIGH, LOW = "out", "low"


def without_low_words(
    named: Sequence[NamedColumn],
) -> tuple[list[NamedColumn], list[NamedColumn]]:
    """Columns without the lower halves of those beside them, and these."""
    whole = {_of_word(one, HIGH) for one in named if HIGH in one.says.label}
    low = [one for one in named
           if LOW in one.says.label and _of_word(one, LOW) in whole]  # fmt: skip
    return [one for one in named if one not in low], low


def _of_word(one: NamedColumn, half: str) -> tuple[object, ...]:
    """What the name of a half says of the word."""
    label = tuple(word for word in one.says.label if word != half)
    return one.says.kind, one.says.axis, label
