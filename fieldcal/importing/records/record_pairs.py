"""Records of an accelerometer and of a gyroscope in turn, put side by side.

    {"sensor": "accelerometer", "t": 0.01, "x": 0.1, "y": 0.2, "z": 9.8}
    {"sensor": "gyroscope", "t": 0.012, "x": 0, "y": 0, "z": 0}

Each record of the accelerometer goes with the gyroscope's nearest in time, within half
a period; nothing is interpolated. Where the accelerometer lacks gravity, and records of
gravity are there, the nearest of these is added.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Index
from fieldcal.importing.times.alignment import nearest_in_time
from fieldcal.importing.times.clock_ratio import clock_ratio, say_apart, say_ratio
from fieldcal.importing.times.gravity_sum import lacks_gravity
from fieldcal.importing.words.file_names import best_name, part_of_force
from fieldcal.importing.words.heading_words import heading_meaning, words_in_name
from fieldcal.importing.words.sensor_words import AXES

Fields = Mapping[str, Array]
"""Values (n,) of each field of records of one kind."""


class MatchedRecords(NamedTuple):
    """Fields of both sensors, the kinds of which they are, and what else was done."""

    fields: dict[str, Array]
    acc: str
    gyr: str
    says: tuple[str, ...]


def pair_records(kinds: Mapping[str, Fields]) -> MatchedRecords | None:
    """Pair the records of both sensors of one IMU; None if there are no such kinds.

    Raises
    ------
    InputError
        If the sensors have no times in common.

    """
    acc, gyr = (best_name(sensor, kinds) for sensor in ("acc", "gyr"))
    if acc is None or gyr is None:
        return None
    force, rate = kinds[acc], kinds[gyr]
    axes = [_axes(fields) for fields in (force, rate)]
    clock = next((name for name in _times(force) if name in _times(rate)), None)
    if clock is None or not all(axes):
        return None
    t, late = force[clock], rate[clock]
    if len(t) < len(AXES) or not np.isfinite(late).any():
        return None
    if (ratio := clock_ratio(t, late)) is None:
        raise InputError(say_apart(t, late, acc, gyr))
    if (near := _Nearest.of(t, late * ratio)) is None:
        return None
    found = {name: force[name] for name in _times(force)}
    found |= {f"acc_{axis}": force[name] for axis, name in axes[0].items()}
    for axis, name in axes[1].items():
        found[f"gyr_{axis}"] = near.values(rate[name])
    says = [*say_ratio(ratio, gyr), _add_gravity(found, kinds, clock)]
    return MatchedRecords(found, acc, gyr, tuple(filter(None, says)))


def _add_gravity(
    found: dict[str, Array], kinds: Mapping[str, Fields], clock: str
) -> str:
    """Add gravity to accelerations that lack it; returns what was done, if anything."""
    name = next((kind for kind in kinds if part_of_force(kind) == "gravity"), None)
    gravity = kinds[name] if name else {}
    axes = _axes(gravity)
    near = _Nearest.of(found[clock], gravity[clock]) if clock in gravity else None
    if near is None or not axes:
        return ""
    acc, down = (
        np.column_stack([fields[names[axis]] for axis in AXES])
        for fields, names in (
            (found, {axis: f"acc_{axis}" for axis in AXES}),
            (gravity, axes),
        )
    )
    if not lacks_gravity(acc, down):
        return ""
    for axis in AXES:
        found[f"acc_{axis}"] = found[f"acc_{axis}"] + near.values(gravity[axes[axis]])
    return f"those of {name} are added to its accelerations, which lack gravity"


class _Nearest(NamedTuple):
    """Which record of another sensor is nearest to each, and where none is near."""

    known: Index
    partner: Index
    far: NDArray[np.bool_]

    @classmethod
    def of(cls, t: Array, late: Array) -> _Nearest | None:
        """Of times (n,) to those of another sensor (m,); None if it has none."""
        known = np.flatnonzero(np.isfinite(late))
        known = known[np.argsort(late[known], kind="stable")]
        if not len(known):
            return None
        partner, apart = nearest_in_time(t, late[known])
        return cls(known, partner, ~(apart <= np.nanmedian(np.abs(np.diff(t))) / 2))

    def values(self, column: Array) -> Array:
        """Values (n,) of the other sensor's records (m,)."""
        near: Array = np.where(self.far, np.nan, column[self.known][self.partner])
        return near


def _axes(fields: Fields) -> dict[str, str]:
    """Name of the field of each axis; empty if they are not three."""
    ends = {name: (words_in_name(name) or [""])[-1] for name in fields}
    found = {axis: [n for n, end in ends.items() if end == axis] for axis in AXES}
    if any(len(names) != 1 for names in found.values()):
        return {}
    return {axis: names[0] for axis, names in found.items()}


def _times(fields: Fields) -> list[str]:
    said = {name: heading_meaning(name) for name in fields}
    return [name for name, one in said.items() if one is not None and one.kind == "t"]
