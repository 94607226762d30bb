"""The thermometer of an IMU among named columns."""

from __future__ import annotations

from collections.abc import Iterable

from fieldcal.importing.headings.best_columns import NamedColumn
from fieldcal.importing.headings.time_columns import columns_of_imu, plainest
from fieldcal.importing.words.thermometer_words import FOREIGN


def thermometer(
    named: Iterable[NamedColumn], label: tuple[str, ...]
) -> tuple[list[NamedColumn], tuple[str, ...]]:
    """Return the thermometer nearest to an IMU, and a message about it.

    Of those that only their unit tells, there must be one.
    """
    warm = [n for n in named if n.says.kind == "temperature"]
    called = [n for n in warm if not n.says.weak]
    near = [n for n in warm if not {*n.says.label} & {*FOREIGN}] or warm
    warm = called or (near if len(near) == 1 else columns_of_imu(warm, label))
    near = columns_of_imu(warm, label) or [
        n for n in warm if not set(n.says.label) & set(FOREIGN)
    ]
    if near or not warm:
        return plainest(near, ()), ()
    chosen = plainest(warm, ())
    other = " ".join(chosen[0].says.label)
    return chosen, (
        f"its only thermometer is that of the {other}: it is taken, but lies apart from"
        " the IMU, so what goes with temperature may lag",
    )
