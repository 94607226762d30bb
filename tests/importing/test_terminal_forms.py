"""Texts of terminals, spreadsheets and LabVIEW, as lines of columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.samples import Array
from fieldcal.importing.text.labview_text import LabviewText
from fieldcal.importing.text.text_forms import forms_of
from fieldcal.importing.text.text_lines import split_lines
from fieldcal.importing.text.text_top import (
    find_stated_rate,
    parse_numbers,
    with_points,
)

ROWS = 12


def values(i: int) -> list[str]:
    return [f"{0.1 * i:.2f}", f"{-0.2 * i:.2f}", "9.80"]


def undone(lines: Sequence[str]) -> list[str]:
    for form in forms_of(lines, None):
        read = form.reader()
        lines = [*read(lines), *read([])]
    return [*lines]


def numbers(lines: Sequence[str]) -> Array:
    return parse_numbers(undone(lines), None)


@pytest.mark.parametrize(
    ("stamp", "separator"),
    [("{} -> ", ","), ("[{}] ", " "), ("[{}] ", ","), ("[2024-05-03 {}] ", "\t"),
     ("{} ", ","), ("2024-05-03 {} ", ";"), ("2024-05-03 {} # ", ","),
     ("2024-05-03 {} - INFO # ", "\t")],
)  # fmt: skip
def test_times_that_a_terminal_writes_before_a_line(stamp: str, separator: str) -> None:
    lines = [stamp.format(f"14:20:{i / 20:06.3f}") + separator.join(values(i))
             for i in range(ROWS)]  # fmt: skip
    found = numbers(lines)
    np.testing.assert_allclose(np.diff(found[:, 0]), 0.05, atol=1e-6)
    np.testing.assert_allclose(found[:, 1], 0.1 * np.arange(ROWS), atol=1e-9)
    assert found.shape == (ROWS, 4)


@pytest.mark.parametrize(
    "prefix",
    ["[INFO] [{:.9f}] [imu_node]: ", "[ INFO] [{:.9f}]: ",
     "[00:00:{:06.3f},000] <inf> imu: ", "[{:08.0f}] <inf> imu: ",
     "05-03 14:20:{:06.3f}  1234  1250 D Imu: ", "[{:.3f}] imu: ",
     "17000000{:05.2f} [INFO] ", "{:.0f} ms | "],
    ids=["ROS 2", "ROS 1", "Zephyr", "Zephyr, ms", "Android", "kernel", "Unix", "ms"],
)  # fmt: skip
def test_what_a_program_s_log_writes_before_a_line_is_its_time(prefix: str) -> None:
    ms = ".0f" in prefix
    stamps = [prefix.format((50 if ms else 0.05) * i) for i in range(ROWS)]
    lines = [f"{stamp}accel: [{', '.join(values(i))}] ax={i}"
             for i, stamp in enumerate(stamps)]  # fmt: skip
    found = numbers(lines)
    np.testing.assert_allclose(np.diff(found[:, 0]), 50 if ms else 0.05, atol=1e-6)
    assert found.shape == (ROWS, 5)


@pytest.mark.parametrize("place", [0, 1, 4])
def test_rows_of_two_sensors_are_told_wherever_their_name_stands(place: int) -> None:
    lines = []
    for i in range(ROWS):
        for name, late in (("accelerometer", 0), ("gyroscope", 3)):
            row = [str(1000 + 20 * i + late), *values(i)]
            row.insert(place, name)
            lines.append(",".join(row))
    assert len(rows := undone(lines)) == ROWS
    assert all(len(row.split(",")) == 5 + 3 for row in rows)
    assert [row.split(",").count("0.30") for row in rows[2:5]] == [0, 2, 0]


def test_a_word_at_the_end_that_names_no_sensor_is_no_kind_of_line() -> None:
    lines = [",".join([str(i), *values(i), word]) for i in range(ROWS)
             for word in ("face up", "face down")]  # fmt: skip
    assert undone(lines) == lines


def labview(step: str, time: bool) -> list[str]:
    header = ["LabVIEW Measurement\t", "Separator\tTab", "***End_of_Header***\t",
              "Channels\t3\t", "Samples\t12\t12\t12\t",
              "Date\t2024/05/03\t2024/05/03\t2024/05/03",
              "X0\t0.0E+0\t0.0E+0\t0.0E+0\t", f"Delta_X\t{step}\t{step}\t{step}\t",
              "***End_of_Header***\t\t\t\t"]  # fmt: skip
    rows = ["\t".join([f"{0.02 * i:.3f}" if time else "", *values(i), ""])
            for i in range(ROWS)]  # fmt: skip
    names = "X_Value\tAcc X\tAcc Y\tAcc Z\tComment"
    segment = [*header[3:], names]
    return [*header, names, *rows[:5], *segment, *rows[5:]]


@pytest.mark.parametrize("time", [True, False])
@pytest.mark.parametrize("step", ["0.020000", "0,020000"])
def test_a_measurement_of_labview_is_its_rows(step: str, time: bool) -> None:
    lines = labview(step, time)
    found = numbers(lines)
    assert found.shape == (ROWS, 5)
    np.testing.assert_allclose(found[:, 1], 0.1 * np.arange(ROWS), atol=1e-9)
    assert np.isnan(found[:, 0]).all() != time
    rate, where = find_stated_rate(undone(lines), None) or (0.0, "")
    assert rate == pytest.approx(50) and where.startswith("Delta_X")


@given(st.lists(st.text(max_size=20), max_size=9), st.integers(0, 9))
def test_it_is_no_matter_how_the_lines_of_labview_come(
    more: list[str], cut: int
) -> None:
    lines = [*labview("0.02", time=True), *more]
    whole, parts = LabviewText().reader(), LabviewText().reader()
    assert whole(lines) == parts(lines[:cut]) + parts(lines[cut:])


@pytest.mark.parametrize(
    ("line", "rate"),
    [("sample interval (ms): 20", 50), ("dt = 0.02 s", 50), ("# Delta_X;0,02;0,02", 50),
     ("Sampling period,20,ms", 50), ("time step 0", 0), ("interval of calm: 3", 0)],
)  # fmt: skip
def test_a_step_above_the_numbers_says_the_rate(line: str, rate: float) -> None:
    found = find_stated_rate([line, "a,b,c", "1,2,3", "2,3,4"], None)
    assert (found[0] if found else 0) == pytest.approx(rate)


@pytest.mark.parametrize(
    "around", ["{}", "<{}>", "{{{}}}", "[{}]"], ids=["bare", "angles", "braces", "list"]
)
def test_rows_between_marks_are_their_numbers(around: str) -> None:
    lines = [around.format(",".join(values(i))) for i in range(ROWS)]
    assert numbers(lines).shape == (ROWS, 3)


def test_the_minus_of_a_spreadsheet_is_one() -> None:
    lines = split_lines("\u22120.5;1\u22122\n".encode())
    assert lines == ["-0.5;1-2"]


@given(st.floats(-1e9, 1e9), st.integers(1, 6))
def test_numbers_of_spreadsheets_are_read_in_either_way(x: float, digits: int) -> None:
    written = f"{x:,.{digits}f}"
    german = written.translate(str.maketrans(",.", ".,"))
    for one in (german, written if "," in written else german):
        assert float(with_points(one)) == float(f"{x:.{digits}f}")


@given(st.sampled_from("\t;"), st.lists(st.integers(1, 3), min_size=2, max_size=4))
def test_spaces_within_cells_part_columns_too(sign: str, widths: list[int]) -> None:
    many = sum(widths)
    table = np.arange(many * ROWS).reshape(ROWS, many) / 4

    def row(words: list[str]) -> str:
        rest = iter(words)
        return sign.join(" ".join(next(rest) for _ in range(n)) for n in widths)

    names = row([f"c{i}" for i in range(many)])
    rows = [row([f"{x:.2f}" for x in line]) for line in table]
    done = undone([names, *rows])
    if max(widths) > 1:
        assert done[0] == sign.join(f"c{i}" for i in range(many))
    np.testing.assert_array_equal(parse_numbers(done, None), table)
