"""Lower halves of words of 32 bits, which programs write as columns of their own.

``XGYRO_LOW`` beside ``XGYRO_OUT``: registers of the sensors of Analog Devices, which
hold 16 bits each (data sheet of the ADIS16375, table 10, and of the ADIS16135, table 8:
the lower and the upper 16 bits). Without the lower ones every number is rounded down,
which is a bias of half a step.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fieldcal.importing.headings.best_columns import NamedColumn

HIGH, LOW = "out", "low"

KINDS = {"a": "low_a", "g": "low_g"}
"""Kinds of the lower halves, by those of the words."""


def split_low_words(
    named: Sequence[NamedColumn],
) -> tuple[list[NamedColumn], list[NamedColumn]]:
    """Columns without the lower halves of those beside them, and these."""
    whole = {_word(one, HIGH) for one in named if HIGH in one.says.label}
    low = [one for one in named if one.says.kind in KINDS
           and LOW in one.says.label and _word(one, LOW) in whole]  # fmt: skip
    return [one for one in named if one not in low], low


def lower_halves(
    low: Sequence[NamedColumn], words: Iterable[NamedColumn]
) -> list[NamedColumn]:
    """Lower halves of words, as columns of their own kind."""
    there = {_word(one, HIGH) for one in words}
    return [
        one._replace(says=one.says._replace(kind=KINDS[one.says.kind], unit=None))
        for one in low
        if _word(one, LOW) in there
    ]


def _word(one: NamedColumn, half: str) -> tuple[object, ...]:
    """What the name of a half says of the word."""
    label = tuple(word for word in one.says.label if word != half)
    return one.says.kind, one.says.axis, label
