"""Records of an accelerometer and of a gyroscope in turn, put side by side.

    {"sensor": "accelerometer", "t": 0.01, "x": 0.1, "y": 0.2, "z": 9.8}
    {"sensor": "gyroscope", "t": 0.012, "x": 0, "y": 0, "z": 0}

Each record of the accelerometer goes with the gyroscope's nearest in time, within half
a period; nothing is interpolated.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.times.alignment import nearest_in_time
from fieldcal.importing.words.file_names import best_name
from fieldcal.importing.words.heading_words import heading_meaning, words_in_name

AXES = ("x", "y", "z")

Fields = Mapping[str, Array]
"""Values (n,) of each field of records of one kind."""


class MatchedRecords(NamedTuple):
    """Fields of both sensors, and the kinds of which they are."""

    fields: dict[str, Array]
    acc: str
    gyr: str


def pair_records(kinds: Mapping[str, Fields]) -> MatchedRecords | None:
    """Pair the records of both sensors of one IMU; None if there are no such kinds."""
    acc, gyr = (best_name(sensor, kinds) for sensor in ("acc", "gyr"))
    if acc is None or gyr is None:
        return None
    force, rate = kinds[acc], kinds[gyr]
    axes = [_axes(fields) for fields in (force, rate)]
    clock = next((name for name in _times(force) if name in _times(rate)), None)
    if clock is None or not all(axes):
        return None
    t, late = force[clock], rate[clock]
    known = np.flatnonzero(np.isfinite(late))
    known = known[np.argsort(late[known], kind="stable")]
    if len(t) < len(AXES) or not len(known):
        return None
    partner, apart = nearest_in_time(t, late[known])
    far = ~(apart <= np.nanmedian(np.abs(np.diff(t))) / 2)
    found = {name: force[name] for name in _times(force)}
    found |= {f"acc_{axis}": force[name] for axis, name in axes[0].items()}
    for axis, name in axes[1].items():
        found[f"gyr_{axis}"] = np.where(far, np.nan, rate[name][known][partner])
    return MatchedRecords(found, acc, gyr)


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
