"""Axes of each sensor among named columns, by what tells one IMU from another."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from fieldcal.importing.headings.best_columns import NamedColumn
from fieldcal.importing.words.heading_words import MEAN, bare_label
from fieldcal.importing.words.sensor_words import AXES


def triads(
    named: Iterable[NamedColumn], kind: str
) -> dict[tuple[str, ...], list[NamedColumn]] | None:
    """Axes of a kind, by the words in which their names differ; None if ambiguous.

    Axes that are not whole are none where others are; nor are those in several units.
    """
    groups: dict[tuple[str, ...], list[NamedColumn]] = {}
    for one in named:
        if one.says.kind == kind:
            label = tuple(w for w in bare_label(one.says.label) if w not in MEAN)
            groups.setdefault(label, []).append(one)
    whole = {label: three for label, three in groups.items() if len(three) == len(AXES)}
    if all(
        len({n.says.axis for n in three}) == len(three) for three in groups.values()
    ):
        groups = whole or groups
    for three in groups.values():
        if sorted(one.says.axis for one in three) != [*AXES]:
            return None
        if len({one.says.unit for one in three}) > 1:
            return None
    return groups


def rates_by_force(
    acc: Mapping[tuple[str, ...], list[NamedColumn]],
    gyr: Mapping[tuple[str, ...], list[NamedColumn]],
) -> dict[tuple[str, ...], list[NamedColumn]]:
    """Gyroscopes of each IMU, by the label of its accelerometers.

    Those with its label, the only ones, or those that share the most words with it.
    """
    found = {}
    for label in acc:
        shared = {own: len({*own} & {*label}) for own in gyr if own not in acc}
        best = [own for own, many in shared.items() if many == max(shared.values())]
        alike = len(best) == 1 and shared[best[0]]
        only = next(iter(gyr)) if len(gyr) == 1 else best[0] if alike else label
        found[label] = gyr.get(label) or gyr.get(only) or []
    return found
