"""Files that say the date, joined where they begin on different days."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned

from fieldcal.core.samples import Array, concat
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.session.merge import FilesInOrder

ROWS = turned(4, 25.0, 1.0)
BEGAN = datetime(2024, 5, 3, 23, 59, 59, 990000)
SIX = "ax,ay,az,gx (rad/s),gy (rad/s),gz (rad/s)"


def written(path: Path, rows: Array, names: str, form: str) -> Path:
    lines = [f"time,{names}"]
    for t, *values in rows.tolist():
        now = f"{BEGAN + timedelta(seconds=t):{form}}"
        lines.append(",".join([now, *(f"{x:.9f}" for x in values)]))
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("form", ["%Y-%m-%d %H:%M:%S.%f", "%d/%m/%Y %H:%M:%S.%f"])
def test_sensors_whose_files_begin_before_and_behind_midnight(
    tmp_path: Path, form: str
) -> None:
    acc = written(tmp_path / "acc.csv", ROWS[:, :4], "ax,ay,az", form)
    rates = np.column_stack([ROWS[:, 0] + 0.012, ROWS[:, 4:]])
    gyr = written(tmp_path / "gyr.csv", rates, SIX[9:], form)
    block, _ = read_files([acc, gyr])
    some = np.isfinite(block.gyr).all(axis=1)
    assert some.mean() > 0.98
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-8)
    np.testing.assert_allclose(block.gyr[some], ROWS[some, 4:], atol=1e-8)


def test_gravity_whose_file_begins_on_another_day_is_added(tmp_path: Path) -> None:
    form = "%Y-%m-%d %H:%M:%S.%f"
    free = np.column_stack([ROWS[:, 0], 0.001 * np.sin(ROWS[:, 1:4])])
    down = np.column_stack([ROWS[:, 0] + 0.012, ROWS[:, 1:4]])
    names = ("Linear Acceleration.csv", "Gravity.csv")
    paths = [
        written(tmp_path / name, rows, "x,y,z", form)
        for name, rows in zip(names, (free, down), strict=True)
    ]
    block, _ = read_files(paths)
    assert len(block) > len(ROWS) - 3
    np.testing.assert_allclose(block.acc, ROWS[: len(block), 1:4], atol=0.002)


def test_files_one_after_another_keep_the_time_between_them(tmp_path: Path) -> None:
    form, half = "%Y-%m-%d %H:%M:%S.%f", len(ROWS) // 2
    later = ROWS + 3600.0 * (np.arange(7) == 0)
    paths = [
        written(tmp_path / f"{i}.csv", rows, SIX, form)
        for i, rows in enumerate((ROWS[:half], later[half:]))
    ]
    files = [open_recording(path, ReadOptions()) for path in paths]
    whole = FilesInOrder(files)
    (stream,) = whole.streams()
    t = concat(whole.blocks(stream.name)).t
    np.testing.assert_allclose(t, np.append(ROWS[:half, 0], later[half:, 0]), atol=1e-4)
    assert "order" not in whole.guessed
