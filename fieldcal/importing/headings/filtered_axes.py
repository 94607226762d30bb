"""Axes that a program filtered, by their names: left out beside those they are of.

t,ax,ay,az,ax_lpf,ay_lpf,az_lpf    of one device both, and only the first are measured
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fieldcal.importing.headings.best_columns import NamedColumn
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.words.heading_words import FILTERED, MEAN, REFERENCE


def without_filtered(
    named: Sequence[NamedColumn],
) -> tuple[list[NamedColumn], list[NamedColumn]]:
    """Columns without axes that are filtered from others, and these.

    Means are only so beside what they are of. Where a sensor has filtered axes alone,
    they are what there is.
    """
    axes = [n for n in named if n.says.kind in ("a", "g") and n.says.axis
            and not {*n.says.label} & {*REFERENCE}]  # fmt: skip
    left: list[NamedColumn] = []
    for words in (FILTERED, MEAN):
        made = [n for n in axes if {*n.says.label} & {*words}]
        plain = {n.says.kind for n in axes if n not in made and n not in left}
        left += [n for n in made if n.says.kind in plain]
    return [n for n in named if n not in left], left


def tell_filtered(
    columns: Sequence[Column],
    left: Sequence[NamedColumn],
    taken: Iterable[NamedColumn],
) -> list[str]:
    """Say which filtered axes were left out, and which were taken for want of others.

    Parameters
    ----------
    columns : in the order of the file
    left, taken : of `without_filtered`

    """
    says = [f"{list_names(columns, left)}: filtered from others; left out"]
    made = [n for n in taken if n.says.axis and {*n.says.label} & {*FILTERED}]
    told = (
        f"{list_names(columns, made)}: a program filtered them, by their names: their"
        " noise and what is quick in them are not the device's"
    )
    return [*(says if left else []), *([told] if made else [])]


def list_names(columns: Sequence[Column], some: Iterable[NamedColumn]) -> str:
    """Names of columns, as the file writes them."""
    return ", ".join(columns[one.number].name for one in some)
