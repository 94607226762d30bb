"""Named columns of which others say the same, and better: they are left out.

Measured values go before what they ought to be and before counts, rates before gains of
angle, a specific force before an acceleration without gravity.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fieldcal.importing.headings.heading import Column
from fieldcal.importing.words.heading_words import (
    REFERENCE,
    HeadingMeaning,
    bare_label,
)
from fieldcal.importing.words.sensor_words import AXES

G_FORCE = (("g",), ("g", "force"))
"""Words of ``gFx``: a program that writes it calls ``ax`` what has no gravity in it."""


class NamedColumn(NamedTuple):
    """Number of a column, and the meaning of its name."""

    number: int
    says: HeadingMeaning


def best_columns(
    columns: Sequence[Column], named: Sequence[NamedColumn]
) -> list[NamedColumn]:
    """Named columns without those that others make needless.

    Parameters
    ----------
    columns : in the order of the file
    named : those whose names say what they are

    """
    named = _with_temperature(columns, _without_references(named))
    return _without_linear_acceleration(_without_counts(_without_angle_gains(named)))


def _with_temperature(
    columns: Sequence[Column], named: Sequence[NamedColumn]
) -> list[NamedColumn]:
    """Columns with "T" taken as temperature if another column is the time."""
    times = [n for n in named if n.says.kind == "t"]
    warm = [n for n in times if columns[n.number].name.strip() == "T"]
    if not warm or len(times) == len(warm):
        return [*named]
    as_warm = [n._replace(says=HeadingMeaning("temperature", "", None)) for n in warm]
    return [n for n in named if n not in warm] + as_warm


def _without_references(named: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Columns without reference values, if there are measured ones."""
    ought = [n for n in named if set(n.says.label) & set(REFERENCE)]
    outputs = {n.says.kind for n in named if n not in ought}
    return [n for n in named if n not in ought or n.says.kind not in outputs]


def _without_angle_gains(named: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Columns without increments of angle, if there are rates."""
    rates = [n for n in named if n.says.kind == "g"]
    gains = [n for n in rates if n.says.weak]
    return [n for n in named if n not in gains or len(gains) == len(rates)]


def _without_counts(named: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Columns without counts, and without a unit, of what is also given in units.

    ``accel_x`` beside ``accel_x_g``, ``temp`` beside ``temp_c`` are counts.
    """
    kinds = ("a", "g", "temperature")
    there = [n for n in named if n.says.kind in kinds]
    in_units = {_axis_of(n) for n in there if n.says.unit}
    return [
        n for n in named
        if n not in there or n.says.unit or _axis_of(n) not in in_units
    ]  # fmt: skip


def _axis_of(one: NamedColumn) -> tuple[str, str, tuple[str, ...]]:
    """Kind, axis and IMU of a column."""
    return one.says.kind, one.says.axis, bare_label(one.says.label)


def _without_linear_acceleration(named: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Columns without accelerations less gravity, if there are specific forces.

    Where gravity stands in columns of its own, both together are what was measured.
    """
    forces = [n for n in named if n.says.kind == "a"]
    if whole := [n for n in forces if n.says.label in G_FORCE]:
        named = [n for n in named if n in whole or n not in forces]
        forces = whole
    if gains := [n for n in forces if n.says.gain]:
        # of what gravity was taken out, gains of velocity tell more
        named = [n for n in named if n in gains or n not in forces or not n.says.weak]
        forces = [n for n in named if n.says.kind == "a"]
    weak = [n for n in forces if n.says.weak]
    gravity = [n for n in named if n.says.kind == "v"]
    others = [n for n in named if n not in weak and n not in gravity]
    if len(weak) < len(forces):
        return others
    axes = [sorted(n.says.axis for n in three) for three in (weak, gravity)]
    if axes != [[*AXES]] * 2 or weak[0].says.unit != gravity[0].says.unit:
        return others + weak
    both = ((gravity, "a"), (weak, "l"))
    parts = [NamedColumn(n.number, n.says._replace(kind=kind, label=(), weak=False))
             for three, kind in both for n in three]  # fmt: skip
    return others + parts
