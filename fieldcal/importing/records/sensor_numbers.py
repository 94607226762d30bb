"""Records that say their sensor by Android's number, where gravity is where it says."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.importing.records.json_record import JsonRecord
from fieldcal.importing.text.sensor_codes import ANDROID, NEAR_G

NAMES = {"sensor", "type", "sensortype", "sensorid", "sensorcode", "kind"}
"""Names of the fields that say it."""

FIRST = 100
"""Records that show the names of the fields."""

FORCE, RATE = "1", "4"
"""Numbers of the accelerometer and the gyroscope."""


def with_named_sensors(records: Sequence[JsonRecord]) -> Sequence[JsonRecord]:
    """Records with the name of the sensor in place of its number."""
    fields = {name for one in records[:FIRST] for name in one.numbers}
    for field in sorted(fields):
        if re.sub(r"[\W_]+", "", field.lower()) not in NAMES:
            continue
        codes = {f"{one.numbers.get(field, np.nan):g}" for one in records} - {"nan"}
        if {FORCE, RATE} <= codes <= {*ANDROID} and _holds_gravity(records, field):
            return [_named(one, field) for one in records]
    return records


def _holds_gravity(records: Sequence[JsonRecord], field: str) -> bool:
    """Whether forces are usually as long as gravity in m/s^2."""
    forces = [one for one in records if one.numbers.get(field) == float(FORCE)]
    axes = [[value for name, value in one.numbers.items() if name[-1:] in "xyzXYZ"]
            for one in forces]  # fmt: skip
    lengths = [np.linalg.norm(three) for three in axes if len(three) == len("xyz")]
    usual = float(np.median(lengths)) if lengths else 0.0
    return abs(usual / G0 - 1) < NEAR_G


def _named(one: JsonRecord, field: str) -> JsonRecord:
    """A record with the name of its sensor."""
    code = f"{one.numbers.get(field, np.nan):g}"
    if code not in ANDROID:
        return one
    rest = {name: value for name, value in one.numbers.items() if name != field}
    texts = {**one.texts, field: ANDROID[code]}
    return one._replace(numbers=rest, texts=texts)
