"""Gyroscopes that are slower than the accelerometers, in whatever files they come."""

from __future__ import annotations

from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from laid_about import turned
from written_logs import imported

from fieldcal.cli import main
from fieldcal.core.samples import Array, Block
from fieldcal.importing.times.slower_sensor import SlowerSensor
from fieldcal.session.folder import Session

ROWS = turned(63, 200.0, 2.0)
SLOW = ROWS[::4]
"""Rows of which the gyroscopes are known."""


def text(rows: Array, unit: str) -> str:
    head = ",".join(
        f'"{name}"' for name in ("Time (s)", *(f"{x} ({unit})" for x in "XYZ"))
    )
    lines = (",".join(f"{x:.9E}" for x in row) for row in rows.tolist())
    return "\n".join([head, *lines]) + "\n"


FILES = {
    "Accelerometer.csv": text(ROWS[:, :4], "m/s^2"),
    "Gyroscope.csv": text(np.column_stack([SLOW[:, 0] + 0.001, SLOW[:, 4:]]), "rad/s"),
}


@pytest.mark.parametrize("packed", [True, False])
def test_both_sensors_are_kept(packed: bool, tmp_path: Path) -> None:
    """Of rows that mostly lack the gyroscopes, `solve` knew nothing of these."""
    if packed:
        with ZipFile(tmp_path / "log.zip", "w") as archive:
            for name, content in FILES.items():
                archive.writestr(name, content)
        folder = imported(tmp_path / "log.zip")
    else:
        for name, content in FILES.items():
            (tmp_path / name).write_text(content)
        paths = [str(tmp_path / name) for name in FILES]
        folder = tmp_path / "out"
        assert main(["import", *paths, "--join", "-o", str(folder)]) == 0
    block = Session.open(folder).block
    np.testing.assert_allclose(block.t - block.t[0], SLOW[:, 0], atol=1e-6)
    np.testing.assert_allclose(block.acc, SLOW[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(block.gyr, SLOW[:, 4:], atol=1e-6)


def through(gyr: Array) -> tuple[int, list[str]]:
    slower = SlowerSensor()
    blocks = [Block.of(ROWS[:0, 0], ROWS[:0, 1:4], ROWS[:0, 4:])]
    blocks += [
        Block.of(ROWS[k : k + 70, 0], ROWS[k : k + 70, 1:4], gyr[k : k + 70])
        for k in range(0, len(ROWS), 70)
    ]
    return sum(map(len, slower.through(blocks))), slower.says


def test_rows_are_left_out_only_where_the_sensor_is_slower() -> None:
    rng = np.random.default_rng(7)
    slow = np.full_like(ROWS[:, 4:], np.nan)
    slow[::4] = ROWS[::4, 4:]
    kept, says = through(slow)
    assert kept == len(SLOW)
    assert says == [
        "one of its sensors is slower than its rows: those that lack it are left out,"
        f" {len(ROWS) - len(SLOW)} in all"
    ]
    lost, late = ROWS[:, 4:].copy(), ROWS[:, 4:].copy()
    lost[rng.random(len(lost)) < 0.1] = np.nan
    late[:600] = np.nan
    for whole in (lost, late, np.full_like(lost, np.nan)):
        assert through(whole) == (len(ROWS), [])
