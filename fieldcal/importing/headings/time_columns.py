"""Which of several named columns is the time of an IMU, or another channel of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fieldcal.importing.headings.best_columns import NamedColumn
from fieldcal.importing.headings.heading import Column

OTHER_CLOCK = ("host", "utc", "gps", "system", "local", "unix", "arrival", "arrived",
               "log", "receive", "received", "recv", "reception", "rx",
               "recorded", "meta")  # fmt: skip
"""Words of times that are another clock's than the device's."""


def columns_of_imu(
    named: Iterable[NamedColumn], label: tuple[str, ...]
) -> list[NamedColumn]:
    """Columns whose names have the label of one of several IMUs."""
    return [n for n in named if label and set(label) <= set(n.says.label)]


def plainest(named: Sequence[NamedColumn], but: Sequence[str]) -> list[NamedColumn]:
    """One of several columns: the shortest name, without `but` if possible."""
    return sorted(
        named, key=lambda n: (bool(set(n.says.label) & set(but)), len(n.says.label))
    )[:1]


def stamps(times: Sequence[NamedColumn]) -> list[NamedColumn]:
    """Times of measurement, without times of arrival if there are both."""
    whole = [n for n in times if n.says.unit is None and "header" in n.says.label]
    return whole or [*times]


def nearest_before(
    clock: NamedColumn,
    times: Sequence[NamedColumn],
    axes: Sequence[NamedColumn],
    columns: Sequence[Column],
) -> NamedColumn:
    """The time that stands next before the first axis, of those that are called alike.

    Programs that write a time before each channel write one for each of their rates.
    """
    first = min(n.number for n in axes)
    name = columns[clock.number].name
    alike = [n for n in times if columns[n.number].name == name and n.number < first]
    return max(alike, key=lambda n: n.number, default=clock)
