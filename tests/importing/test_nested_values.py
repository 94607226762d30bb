"""Values within brackets, and decimal commas between commas, as lines of columns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laid_about import G, turned, write
from test_terminal_forms import ROWS, numbers
from written_logs import DEG, A, T, W, assert_same, imported

from fieldcal.cli import main
from fieldcal.importing.text.nested_values import NestedValues
from fieldcal.importing.text.split_decimals import SplitDecimals
from fieldcal.importing.text.text_forms import forms_of


def test_the_sensor_of_a_list_is_the_record_that_it_lies_in(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(
        "".join(
            f"Sample {{ Time = {t:.4f}, Accel = Vec {{ Unit = G, Data ="
            f" <{', '.join(f'{x:.8g}' for x in a)}> }}, Gyro = Vec {{ Unit = Dps, Data"
            f" = <{', '.join(f'{x:.8g}' for x in w)}> }} }}\n"
            for t, a, w in zip(T, A / G, DEG, strict=True)
        )
    )
    assert_same(imported(path))


@pytest.mark.parametrize(
    ("row", "first"),
    [
        ("{t} V3(x={0}, y={1}, z={2}) V3(x={3}, y={4}, z={5})", 0),
        ("({t}, ({0}, {1}, {2}), ({3}, {4}, {5}))", 0),
        ("14:20:{t} -> (({0}, {1}, {2}), ({3}, {4}, {5}))", 0),
        ("[INFO] [17{t}] [imu]: (({0}, {1}, {2}), ({3}, {4}, {5}))", 1700),
        ("14:20:{t}0000 [Info] D {{ A = ({0}, {1}, {2}), B = ({3}, {4}, {5}) }}", 0),
        ("[17{t}] imu: Acc(x={0}, y={1}, z={2}) Gyr(x={3}, y={4}, z={5})", 1700),
    ],
)
def test_brackets_without_a_sensor_are_columns(row: str, first: float) -> None:
    values = [[0.1 * i, -0.2, 9.8, 1e-3, -2.0, 3.0] for i in range(ROWS)]
    text = [row.format(*v, t=f"{i / 20:06.3f}") for i, v in enumerate(values)]
    found = numbers(text)
    np.testing.assert_allclose(np.diff(found[:, 0]), 0.05, atol=1e-6)
    np.testing.assert_allclose(found[:, 1:], values, atol=1e-9)
    if first:
        np.testing.assert_allclose(found[0, 0], first)


@pytest.mark.parametrize(
    "line",
    ["acc: (0.1, 0.2, 9.8)", "1.0, 2.0 [3.0], 4.0", "Acc (mg) [ 1, 2, 3 ]",
     "acc: {x: 0.1, y: 0.2, z: 9.8} gyr: {x: 0, y: 0, z: 0}",
     "((1, 2, 3)", "V(x=1, y=2, z=3))"],
)  # fmt: skip
def test_what_has_no_brackets_in_others_is_another_form(line: str) -> None:
    assert NestedValues.of([line] * 5, None) is None


@given(st.lists(st.text(alphabet="([{<>}])=:, ax1.-'\n", max_size=30), min_size=1))
def test_any_brackets_are_values_or_are_not(lines: list[str]) -> None:
    form = NestedValues.of(lines, None)
    if form is not None:
        assert len(form.reader()(lines)) == len(lines)


def test_lines_of_no_numbers_are_not_asked_for_their_columns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "log.txt"
    path.write_text("the device is ready, and waits\n" * 20)
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "no line of it is a row of numbers" in said and "--columns" not in said


def with_commas(times: Sequence[float], digits: int) -> list[str]:
    rows = [f"{t:.{digits}f}".replace(".", ",") for t in times]
    return [f"{t},0.5,{0.1 * i:.2f},-9.8" for i, t in enumerate(rows)]


def test_a_time_with_a_decimal_comma_is_one_between_commas() -> None:
    times = 0.25 * np.arange(20)
    for digits in (2, 3):
        text = ["time,ax,ay,az", *with_commas(times.tolist(), digits)]
        found = numbers(text)
        np.testing.assert_allclose(found[:, 0], times)
        np.testing.assert_allclose(found[:, 3], -9.8)


def test_whole_numbers_of_such_a_time_have_no_comma() -> None:
    rows = [("1" if i == 4 else f"0,{2 * i}" if i < 5 else f"1,{2 * (i - 5)}")
            + ",0.5,0.1,-9.8" for i in range(10)]  # fmt: skip
    text = ["time,ax,ay,az", *(row for i, row in enumerate(rows) if i != 4)]
    (form,) = forms_of(text, None)
    read = form.reader()([*text, "2,0.5,0.1,-9.8"])
    assert read[1] == "0.0,0.5,0.1,-9.8" and read[-1] == "2,0.5,0.1,-9.8"


def test_all_numbers_of_a_row_may_have_decimal_commas_between_commas() -> None:
    rows = [f"0,{10 + i},-0,5,9,{80 + i}" for i in range(9)]
    found = numbers(["t,ax,az", *rows])
    np.testing.assert_allclose(found[0], [0.10, 5, 9.80] * np.array([1, -0.1, 1]))


def test_a_number_of_the_row_without_a_name_is_no_whole_part() -> None:
    rows = [f"{i + 1},{1000 + 20 * i},0.5,0.1,-9.8" for i in range(9)]
    assert SplitDecimals.of(["time,ax,ay,az", *rows], None) is None


def test_values_that_stay_over_rows_tell_how_fast_the_sensor_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = np.column_stack([T, A, W])
    rows[:, 1:4] = rows[np.arange(len(T)) // 4 * 4, 1:4]
    path = write(tmp_path, rows, heading="t,ax,ay,az,gx,gy,gz")
    imported(path)
    said = capsys.readouterr().err
    own = 0.25 / float(np.diff(T).mean())
    assert (
        f"accelerometers stay over about 4 rows each: they measure at {own:.3g}" in said
    )
    assert "values of its gyroscopes" not in said


def test_values_may_stay_over_now_more_now_fewer_rows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A program takes what a slow gyroscope has sent last."""
    rows = turned(5, 50.0, 2.0, sides=7)
    stays = np.random.default_rng(5).integers(4, 9, len(rows))
    rows[:, 4:] = np.repeat(rows[:, 4:], stays, axis=0)[: len(rows)]
    imported(write(tmp_path, rows, heading="t,ax,ay,az,gx,gy,gz"))
    said = capsys.readouterr().err
    assert "its gyroscopes stay over about 6 rows each" in said
    assert "values of its accelerometers" not in said


def test_coarse_counts_of_a_device_at_rest_tell_no_rate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = np.column_stack([T, np.round(A, 1), W])
    imported(write(tmp_path, rows, heading="t,ax,ay,az,gx,gy,gz"))
    assert "stay over" not in capsys.readouterr().err
