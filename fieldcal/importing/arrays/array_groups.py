"""Groups of a file of arrays that each hold an IMU: a folder of HDF5, a structure.

Where the names of all arrays leave a choice, as there are two accelerometers, those
within one group may leave none. Such a group is an IMU, with times of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from fieldcal.importing.arrays.array_tables import ArrayTable, columns_of
from fieldcal.importing.headings import headings

T = TypeVar("T")

NEEDED_SENSORS = ({"a", "g"}, {"a"})
"""What a group has to hold: both sensors, or force alone where nothing has rates."""


def imu_groups(tables: Mapping[str, ArrayTable]) -> dict[str, str]:
    """Groups that hold one IMU each, by its name; none where there are not several.

    Parameters
    ----------
    tables : by name, with a ``/`` behind each group that they lie in

    """
    folders = sorted({f for name in tables for f in _folders(name)})
    if len(folders) < 2 or headings.match_headings(columns_of(tables)):
        return {}
    kinds = {folder: _kinds(arrays_in_group(folder, tables)) for folder in folders}
    for wanted in NEEDED_SENSORS:
        if found := [f for f in folders if wanted <= kinds[f]]:
            whole = [f for f in found if not any(o.startswith(f"{f}/") for o in found)]
            return dict(zip(_names(whole), whole, strict=True)) if whole[1:] else {}
    return {}


def arrays_in_group(folder: str, named: Mapping[str, T]) -> dict[str, T]:
    """Arrays of a group and of the groups within it; all if no group is named."""
    begins = folder and f"{folder}/"
    return {name: one for name, one in named.items() if name.startswith(begins)}


def _folders(name: str) -> list[str]:
    """Groups that an array lies in.

    >>> _folders("a/b/acc")
    ['a', 'a/b']
    """
    parts = name.split("/")[:-1]
    return ["/".join(parts[: i + 1]) for i in range(len(parts))]


def _kinds(tables: Mapping[str, ArrayTable]) -> set[str]:
    """Sensors that the names of arrays state; none if they state several IMUs."""
    found = headings.match_headings(columns_of(tables))
    return {*found[0].units} if len(found) == 1 else set()


def _names(folders: list[str]) -> list[str]:
    """Names of the groups: the last part, or the whole where two share that."""
    last = [folder.rpartition("/")[2] for folder in folders]
    return last if len({*last}) == len(last) else folders
