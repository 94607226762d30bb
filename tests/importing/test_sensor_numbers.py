"""Records in JSON whose sensor is said by a number of Android's."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import G, turned

from fieldcal.core.errors import InputError

ROWS = turned(53, 50.0, 2.0)


def log(field: str, force: float = 1.0) -> str:
    found = []
    for t, *row in ROWS.tolist():
        us = round(t * 1e6)
        found += [{field: 1, "ts": us, "values": [x * force for x in row[:3]]},
                  {field: 4, "ts": us + 300, "values": row[3:]},
                  {field: 2, "ts": us + 600, "values": [20.0, -3.0, 40.0]}]  # fmt: skip
    return "\n".join(map(json.dumps, found)) + "\n"


@pytest.mark.parametrize("field", ["sensor", "sensorType", "type"])
def test_numbers_of_android_name_sensors(field: str, tmp_path: Path) -> None:
    path = tmp_path / "log.json"
    path.write_text(log(field))
    block, says = read_files([path])
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-9)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-9)
    assert any("those of accelerometer are taken" in said for said in says)


@pytest.mark.parametrize(("field", "force"), [("sensor", 1 / G), ("count", 1.0)])
def test_other_numbers_are_none_of_android(
    field: str, force: float, tmp_path: Path
) -> None:
    path = tmp_path / "log.json"
    path.write_text(log(field, force))
    with pytest.raises(InputError):
        read_files([path])
