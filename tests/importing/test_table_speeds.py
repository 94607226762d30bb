"""Tables of means on a rate table, whose rate stands in a column or nowhere."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.tables.table_speeds import (
    speed_columns,
    table_speeds,
    turned_rows,
)

G = 9.80665
AXES = [[0, 0, 1], [0, 0, -1], [0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0],
        [0.7, 0.7, 0.14], [0.6, 0, 0.8], [0, 0.6, -0.8]]  # fmt: skip
SCALE, BIAS = np.array([1.01, 0.99, 1.02]), np.array([0.01, -0.02, 0.005])
SCATTER = ",0.0021,0.0022,0.002"
STD = "gx_std,gy_std,gz_std"


def means() -> tuple[Array, Array, Array]:
    """Speeds, deg/s, forces and rates of a device about nine axes, SI."""
    rng = np.random.default_rng(5)
    axes = np.repeat(np.array(AXES, float), 3, axis=0)
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    speed = np.tile([0.0, 60.0, -60.0], len(AXES))
    force = G * axes + 0.1 + rng.normal(0, 0.002, axes.shape)
    rate = SCALE * np.deg2rad(speed)[:, None] * axes + BIAS
    return speed, force, rate + rng.normal(0, 0.0002, axes.shape)


SPEED, FORCE, RATE = means()


def write(folder: Path, head: str, *columns: Array, more: str = "") -> Path:
    path = folder / "table.csv"
    rows = np.column_stack(columns).tolist()
    lines = [",".join(f"{x:.9g}" for x in row) + more for row in rows]
    path.write_text("\n".join([head, *lines]) + "\n")
    return path


def gyro_scale(folder: Path) -> list[float]:
    assert main(["solve", str(folder), "--json"]) == 0
    result = json.loads((folder / "result.json").read_text())
    found: list[float] = result["parameters"]["gyr_scale"]["value"]
    return found


@pytest.mark.parametrize(
    ("head", "columns", "more"),
    [
        (f"rate (deg/s),ax,ay,az,gx,gy,gz,{STD}", (SPEED, FORCE, RATE), SCATTER),
        (f"speed_dps,gx_mean,gy_mean,gz_mean,{STD},n", (SPEED, RATE), f"{SCATTER},99"),
        (f"table rate,gx,gy,gz,{STD}", (np.deg2rad(SPEED), RATE), SCATTER),
        ("rate (rad/s),gx,gy,gz", (np.deg2rad(SPEED), RATE), ""),
    ],
    ids=["with forces", "rates alone", "a rate without a unit", "sigma by the user"],
)
def test_the_rate_of_a_table_gives_the_scale_of_gyroscopes(
    tmp_path: Path, head: str, columns: tuple[Array, ...], more: str
) -> None:
    path, folder = write(tmp_path, head, *columns, more=more), tmp_path / "out"
    options = [] if more else ["--sigma", "0.1,0.0002"]
    assert main(["import", str(path), "-o", str(folder), "--gyr-unit", "rad/s",
                 *options]) == 0  # fmt: skip
    positions = tomllib.loads((folder / "session.toml").read_text())["position"]
    shown = [one.get("speed_deg_s", 0.0) for one in positions]
    np.testing.assert_allclose(shown, np.abs(SPEED), rtol=1e-6)
    np.testing.assert_allclose(gyro_scale(folder), SCALE, atol=1e-3)


@pytest.mark.parametrize(
    ("names", "parts"),
    [("cmd_x (deg/s),cmd_y (deg/s),cmd_z (deg/s)", 3),
     ("inner_rate_dps,outer_rate_dps", 2), ("table x,table y,table z", 3)],
)  # fmt: skip
def test_the_rates_of_several_axes_are_one_rate(
    tmp_path: Path, names: str, parts: int
) -> None:
    axes = np.repeat(np.array(AXES, float), 3, axis=0)
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    each = SPEED[:, None] * axes
    if parts == 2:
        # the outer axis lies across the inner one, wherever that stands
        each = np.column_stack([np.hypot(each[:, 0], each[:, 1]), each[:, 2]])
    head = f"{names},ax,ay,az,gx,gy,gz,{STD}"
    path, folder = (
        write(tmp_path, head, each, FORCE, RATE, more=SCATTER),
        tmp_path / "o",
    )
    assert main(["import", str(path), "-o", str(folder), "--gyr-unit", "rad/s"]) == 0
    positions = tomllib.loads((folder / "session.toml").read_text())["position"]
    shown = [one.get("speed_deg_s", 0.0) for one in positions]
    np.testing.assert_allclose(shown, np.abs(SPEED), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(gyro_scale(folder), SCALE, atol=1e-3)


def test_rows_that_turn_at_no_known_rate_show_no_bias(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Taken for rests they would be biases of 60 deg/s."""
    head = f"ax,ay,az,gx,gy,gz,{STD}"
    path = write(tmp_path, head, FORCE, RATE, more=SCATTER)
    folder = tmp_path / "out"
    assert main(["import", str(path), "-o", str(folder), "--gyr-unit", "rad/s"]) == 0
    assert "18 of its rows turned, at up to 61" in capsys.readouterr().err
    positions = tomllib.loads((folder / "session.toml").read_text())["position"]
    unknown = [len(one["sigma"]) == 3 for one in positions]
    assert unknown == (SPEED != 0).tolist()


def test_rates_alone_that_turn_at_no_known_rate_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, f"gx,gy,gz,{STD}", RATE, more=SCATTER)
    assert main(["import", str(path), "-o", str(tmp_path / "out"), "--gyr-unit",
                 "rad/s"]) == 2  # fmt: skip
    assert "write it into one, such as rate (deg/s)" in capsys.readouterr().err


def test_a_rate_at_which_nothing_turns_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    head = f"rate (deg/s),gx,gy,gz,{STD}"
    path = write(tmp_path, head, SPEED, RATE, more=SCATTER)
    assert main(["import", str(path), "-o", str(tmp_path / "out"), "--gyr-unit",
                 "deg/s"]) == 2  # fmt: skip
    assert "0.0176 times as fast as its column" in capsys.readouterr().err


@given(
    st.lists(st.sampled_from([0.0, 20.0, -50.0, 200.0]), min_size=2, max_size=30),
    st.floats(0.8, 1.2),
    st.sampled_from([1.0, float(np.rad2deg(1.0))]),
)
def test_speeds_are_read_in_the_unit_in_which_the_device_turned(
    speeds: list[float], scale: float, unit: float
) -> None:
    true = np.deg2rad(speeds)
    gyr = np.column_stack([0 * true, scale * true, 0 * true]) + 0.001
    gyr = gyr if 0.0 in speeds else gyr - 0.001
    said = table_speeds(true * unit, "", gyr, "f.csv")
    known = true != 0
    np.testing.assert_allclose(said[known], np.abs(true)[known], rtol=1e-9)


@given(st.text(max_size=20))
def test_no_name_breaks_the_search_for_a_speed(name: str) -> None:
    assert speed_columns([Column("", name)]) in ([], [0])


def test_a_bias_is_no_turn() -> None:
    gyr = np.tile([[0.3, -0.2, 0.1]], (9, 1))
    assert not turned_rows(gyr).any()
    gyr[4] += 0.2
    assert turned_rows(gyr).tolist() == [i == 4 for i in range(9)]
    with pytest.raises(InputError, match="times as fast"):
        table_speeds(np.full(9, 10.0), "deg/s", gyr * 100, "f.csv")
