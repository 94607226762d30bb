"""Axes that stand in another order than x y z, as a name beside them says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned, write

from fieldcal.core.samples import Array
from fieldcal.importing.words.listed_axes import listed_axes

ROWS = turned(15, 50.0, 2.0)
T, A, W = ROWS[:, :1], ROWS[:, 1:4], ROWS[:, 4:]
CAMERA = [2, 0, 1]
"""Order in which cameras by GoPro write the axes: z, x, y."""


def test_columns_below_one_name_are_the_axes_that_it_lists(tmp_path: Path) -> None:
    paths = []
    for name, unit, three in (("Accelerometer", "m/s2", A), ("Gyroscope", "rad/s", W)):
        head = f'"cts","{name} (z,x,y) [{unit}]","1","2","temperature [°C]"'
        rows = np.hstack([1e3 * T, three[:, CAMERA], 31 + T / 100])
        paths.append(write(tmp_path, rows, f"{name}.csv", head))
    block, _ = read_files(paths)
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-6)


def test_lists_have_the_axes_that_a_text_beside_them_lists(tmp_path: Path) -> None:
    def stream(name: str, three: Array) -> dict[str, object]:
        values = zip(T[:, 0].tolist(), three[:, CAMERA].tolist(), strict=True)
        return {"samples": [{"value": v, "cts": 1e3 * t} for t, v in values],
                "name": f"{name} (z,x,y)"}  # fmt: skip

    streams = {"ACCL": stream("Accelerometer", A), "GYRO": stream("Gyroscope", W)}
    path = tmp_path / "log.json"
    path.write_text(json.dumps({"1": {"streams": streams}, "frames/second": 23.9}))
    block, _ = read_files([path])
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-9)


@pytest.mark.parametrize(
    "name", ["Accel (x)", "Accel (x,y)", "Accel (x,x,z)", "Accel (a,b,c)", "x,y,z"]
)
def test_other_brackets_list_no_axes(name: str) -> None:
    assert listed_axes(name) == ()
