"""Units that headings state, beside those of SI and g; and temperatures without one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned, write

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.read_options import ReadOptions

ROWS = turned(37, 50.0, 2.0)
WARM = 21.0 + 5 * ROWS[:, 0] / ROWS[-1, 0]


def in_units(acc: str, gyr: str, force: float, rate: float) -> tuple[str, Array]:
    head = [f"a{x} ({acc})" for x in "xyz"] + [f"gyro_{x} [{gyr}]" for x in "xyz"]
    table = np.column_stack([ROWS[:, 0], ROWS[:, 1:4] * force, ROWS[:, 4:] * rate])
    return ",".join(["t", *head]), table


@pytest.mark.parametrize(
    ("acc", "gyr", "force", "rate"),
    [
        ("ft/s^2", "rev/s", 1 / 0.3048, 1 / (2 * np.pi)),
        ("in/s²", "rpm", 1 / 0.0254, 60 / (2 * np.pi)),
        ("m/s^2", "µrad/s", 1.0, 1e6),
        ("ft/s/s", "deg/s", 1 / 0.3048, 180 / np.pi),
    ],
)
def test_units_over_columns_are_read(
    acc: str, gyr: str, force: float, rate: float, tmp_path: Path
) -> None:
    head, table = in_units(acc, gyr, force, rate)
    block, _ = read_files([write(tmp_path, table, heading=head)])
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-6)


def with_temperatures(folder: Path, warm: Array, name: str = "temp") -> Path:
    table = np.column_stack([ROWS, warm])
    return write(folder, table, heading=f"t,ax,ay,az,gx,gy,gz,{name}")


@pytest.mark.parametrize(
    ("warm", "answer"),
    [(np.round(WARM * 1.8 + 32, 1), "--temp-unit degF or --temp-unit degC"),
     (np.round(WARM * 10) + 30, "--temp-unit K or --temp-unit ddegC"),
     (np.round(WARM) + 273, "--temp-unit K or --temp-unit ddegC")],
)  # fmt: skip
def test_temperatures_that_two_units_fit_are_asked_about(
    warm: Array, answer: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=answer):
        read_files([with_temperatures(tmp_path, warm)])


@pytest.mark.parametrize(
    ("warm", "name", "unit"),
    [(WARM * 1.8 + 32, "temp", "degF"), (np.round(WARM * 10), "temp", ""),
     (WARM * 10, "temp", "ddegC"),
     (WARM * 10, "temp (0.1 degC)", ""), (np.round(WARM * 1e3), "temp", ""),
     (WARM + 50, "temp", "degC"), (np.round(WARM, 2) + 273.15, "temp", "")],
)  # fmt: skip
def test_temperatures_in_a_unit_that_is_known(
    warm: Array, name: str, unit: str, tmp_path: Path
) -> None:
    path = with_temperatures(tmp_path, warm, name)
    block, _ = read_files([path], ReadOptions(temp_unit=unit))
    known = warm if unit == "degC" else WARM
    np.testing.assert_allclose(block.temperature, known, atol=0.051)


@pytest.mark.parametrize(("unit", "second"), [("", 0.0), ("min", 60.0), ("s", 1.0)])
def test_a_log_of_a_moment_in_s_may_be_in_min(
    unit: str, second: float, tmp_path: Path
) -> None:
    table = ROWS.copy()
    table[:, 0] /= 60
    path = write(tmp_path, table, heading="t,ax,ay,az,gx,gy,gz")
    if not unit:
        with pytest.raises(InputError, match="50 Hz in min: add --time-unit s or"):
            read_files([path])
        return
    block, _ = read_files([path], ReadOptions(time_unit=unit))
    np.testing.assert_allclose(block.t, table[:, 0] * second, atol=1e-6)


def test_gravity_that_is_called_gx_is_no_rate(tmp_path: Path) -> None:
    up = ROWS[:, 1:4] / np.linalg.norm(ROWS[:, 1:4], axis=1)[:, None] * 9.80665
    table = np.column_stack([ROWS[:, :4], up, ROWS[:, 4:]])
    path = write(tmp_path, table, heading="t,ax,ay,az,gx,gy,gz,rx,ry,rz")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-6)
