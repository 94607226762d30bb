"""Logs as people and their programs write them are read with nothing said."""

from __future__ import annotations

import re
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import G, turned
from small_files import write_workbook
from written_logs import (
    DEG,
    FORMS,
    ROWS,
    SIX,
    UNIX,
    A,
    T,
    W,
    assert_rows,
    assert_same,
    clock,
    imported,
    lines,
)

from fieldcal.cli import main
from fieldcal.importing.columns import to_signed_16_bit
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.text.cell_forms import HexCells, ListCells
from fieldcal.importing.text.line_forms import EchoedMessages
from fieldcal.importing.times.row_times import RowTimes
from fieldcal.session.folder import Session


@pytest.mark.parametrize("name", FORMS)
def test_a_form_is_read_with_nothing_said(tmp_path: Path, name: str) -> None:
    path = tmp_path / "log.txt"
    path.write_text(FORMS[name]() + "\n", encoding="utf-8")
    assert_rows(read_files([path])[0])


@pytest.mark.parametrize(
    "slow",
    [slice(0, 3), pytest.param(slice(3, 6), marks=pytest.mark.thorough)],
    ids=["acc", "gyr"],
)
def test_a_sensor_that_is_slower_than_the_rows_is_read_with_the_other(
    tmp_path: Path, slow: slice, capsys: pytest.CaptureFixture[str]
) -> None:
    path, held = tmp_path / "log.csv", turned(5, 50.0, 2.0, sides=7)
    rows = [f"t,{SIX}"]
    for i, row in enumerate(held.tolist()):
        cells = [f"{x:.8g}" for x in row[1:]]
        cells[slow] = cells[slow] if i % 2 == 0 else [""] * 3
        rows.append(",".join([f"{row[0]:.4f}", *cells]))
    path.write_text("\n".join(rows) + "\n")
    session = Session.open(imported(path))
    acc, gyr = held[::2, 1:4], held[::2, 4:]
    np.testing.assert_allclose(session.block.acc, acc, rtol=1e-6)
    np.testing.assert_allclose(session.block.gyr, gyr, rtol=1e-6, atol=1e-8)
    assert main(["solve", str(session.folder)]) in (0, 1)
    assert "acc bias x" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["dt_ms", "delta_ms", "interval (ms)"])
@pytest.mark.parametrize("since_start", [False, True])
def test_steps_of_time_that_grow_are_the_time(
    tmp_path: Path, name: str, since_start: bool
) -> None:
    path = tmp_path / "log.csv"
    t = np.round(ROWS[:, 0] * 1e3)
    t = t if since_start else np.diff(t, prepend=t[0] - 20)
    rows = [
        ",".join(f"{x:.8g}" for x in (ms, *row[1:]))
        for ms, row in zip(t, ROWS.tolist(), strict=True)
    ]
    path.write_text("\n".join([f"{name},{SIX}", *rows]) + "\n")
    got = Session.open(imported(path)).block
    np.testing.assert_allclose(got.t - got.t[0], ROWS[:, 0] - ROWS[0, 0], atol=1e-6)


def test_rows_of_several_imus_in_turn_are_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = ["imu,t,ax,ay,az,gx,gy,gz"]
    for row in ROWS.tolist():
        for i in (0, 1):
            own = [i, *row[:3], row[3] + i, *row[4:]]
            rows.append(",".join(f"{x:.8g}" for x in own))
    path.write_text("\n".join(rows) + "\n")
    folder = imported(path)
    assert_same(folder / "0")
    other = Session.open(folder / "1").block
    np.testing.assert_allclose(other.acc[:, 2], A[:, 2] + 1, atol=1e-5)


def test_one_row_a_second_by_a_clock_is_taken_so(tmp_path: Path) -> None:
    """Seconds since 1970 count no rows, and a real clock shows a little less."""
    path = tmp_path / "log.csv"
    stamps = [f"{UNIX + 1.0002 * i:.4f}" for i in range(len(T))]
    path.write_text(lines(stamps, A, 0 * W, head=f"t,{SIX}") + "\n")
    t = Session.open(imported(path)).block.t
    np.testing.assert_allclose(np.diff(t), 1.0002, atol=1e-6)
    shutil.rmtree(tmp_path / "out")
    whole = [f"{UNIX + i}" for i in range(len(T))]
    path.write_text(lines(whole, A, 0 * W, head=f"t,{SIX}") + "\n")
    assert np.ptp(Session.open(imported(path)).block.t) == len(T) - 1


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ("{0}X {0}Y {0}Z", ("1", "2")),
        ("{0}X ({1}) {0}Y ({1}) {0}Z ({1})", ("bmi", "mpu")),
    ],
)
def test_names_that_come_again_are_of_several_imus(
    tmp_path: Path, names: str, told: tuple[str, str]
) -> None:
    path, second = tmp_path / "log.csv", A + [0, 0, 1]
    head = " ".join(
        names.format(sensor, chip) for chip in ("BMI", "MPU") for sensor in ("Acc", "G")
    )
    text = lines(T, A, W, second, W, head=",".join(["t", *re.split(" (?!\\()", head)]))
    path.write_text(text + "\n")
    folder = imported(path)
    assert_same(folder / told[0])
    other = Session.open(folder / told[1]).block
    np.testing.assert_allclose(other.acc, second, atol=1e-6)


def test_a_workbook_is_read(tmp_path: Path) -> None:
    path = tmp_path / "log.xlsx"
    names = [
        "Time (s)",
        *(f"Accel {x} (g)" for x in "XYZ"),
        *(f"Gyro {x} (dps)" for x in "XYZ"),
    ]
    write_workbook(path, [names, *np.column_stack([T, A / G, DEG]).tolist()])
    assert_same(imported(path))


@pytest.mark.parametrize(
    "version", ["v7", pytest.param("v7.3", marks=pytest.mark.thorough)]
)
def test_a_timetable_is_read(tmp_path: Path, version: str) -> None:
    pandas, matio = pytest.importorskip("pandas"), pytest.importorskip("matio")
    frame = pandas.DataFrame({"Acceleration": list(A), "AngularVelocity": list(W)},
                             index=pandas.to_timedelta(T, unit="s"))  # fmt: skip
    frame.index.name = "Time"
    path = tmp_path / "log.mat"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        matio.save_to_mat(str(path), {"imu": frame}, version=version)
    assert_same(imported(path))


def test_a_folder_of_oxts_samples_is_read(tmp_path: Path) -> None:
    folder = tmp_path / "oxts"
    (folder / "data").mkdir(parents=True)
    stamps = clock("%Y-%m-%d %H:%M:%S.%f000")
    (folder / "timestamps.txt").write_text("\n".join(stamps) + "\n")
    for i, (a, w) in enumerate(zip(A.tolist(), W.tolist(), strict=True)):
        row = [49.0, 8.4, 112.8, *[0.0] * 8, *a, *a, *w, *w, 0.5, 0.1, 4, 10, 4, 4, 0]
        (folder / "data" / f"{i:010}.txt").write_text(" ".join(map(str, row)))
    assert_same(imported(folder))
    (folder / "data" / "0000000000.txt").unlink()
    out = tmp_path / "again"
    assert main(["import", str(folder), "-o", str(out)]) == 2


@given(st.lists(st.integers(-(2**15), 2**15 - 1), min_size=3, max_size=3))
def test_hexadecimal_counts_keep_their_sign(counts: list[int]) -> None:
    text = [" ".join(f"{x & 0xFFFF:04X}" for x in counts), *["ABCD 0ABC FFFF"] * 3]
    form = HexCells.of(text, None)
    assert form is not None
    read = [[int(c) for c in line.split()] for line in form.reader()(text)]
    assert read == [counts, *[[0xABCD - 2**16, 0x0ABC, -1]] * 3]
    assert (
        to_signed_16_bit(np.mod(np.array(counts, dtype=float), 2**16)).tolist()
        == counts
    )


def test_a_column_filled_with_zeros_is_as_hexadecimal_as_the_others() -> None:
    text = ["1000 0312 FE64 FFFFFFE8 001A 00B0", "1010 0313 FE64 0002 FFFFFFFF 00B0"]
    form = HexCells.of(text * 3, None)
    assert form is not None
    assert [[int(c) for c in line.split()] for line in form.reader()(text)] == [
        [1000, 0x312, -0x19C, -24, 26, 0xB0],
        [1010, 0x313, -0x19C, 2, -1, 0xB0],
    ]


@given(
    st.lists(st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3), min_size=2),
    st.sampled_from(["[]", "()", "{}"]), st.sampled_from([", ", " ", ","]),
)  # fmt: skip
def test_numbers_of_a_list_in_a_cell_are_cells(
    rows: list[list[float]], brackets: str, between: str
) -> None:
    text = [f"{i},{brackets[0]}{between.join(map(repr, r))}{brackets[1]}"
            for i, r in enumerate(rows)]  # fmt: skip
    form = ListCells.of(["n,acc", *text], None)
    assert form is not None and form.names == ("n", "acc_x", "acc_y", "acc_z")
    read = [[float(c) for c in line.split(",")] for line in form.reader()(text)]
    assert read == [[i, *row] for i, row in enumerate(rows)]


@given(st.lists(st.dictionaries(st.sampled_from("abcdef"), st.integers(), min_size=3),
                min_size=3), st.data())  # fmt: skip
def test_messages_are_put_together_however_the_lines_come(
    messages: list[dict[str, int]], data: st.DataObject
) -> None:
    text = []
    for m in messages:
        text += ["one:", *(f"  {name}: {x}" for name, x in m.items()), "---"]
    form = EchoedMessages.of(text, None)
    if form is None:
        usual = [
            k for k in "abcdef" if sum(k in m for m in messages) > len(messages) / 2
        ]
        assert len(usual) < 3
        return
    cut, read = data.draw(st.integers(0, len(text))), form.reader()
    expected = [",".join(str(m.get(n[-1], "")) for n in form.names) for m in messages]
    assert read(text[:cut]) + read(text[cut:]) == expected


@given(st.sampled_from([16, 24, 32]), st.integers(1, 9), st.lists(st.integers(0, 400)))
def test_a_counter_that_begins_again_goes_on(
    bits: int, step: int, cuts: list[int]
) -> None:
    true = 2**bits - 200 * step + step * np.arange(400)
    counts, times = np.mod(true, 2**bits).astype(float), RowTimes(ReadOptions())
    edges = [0, *sorted(cuts), 400]
    parts = [times.of({"t": counts[a:b]}, b - a)
             for a, b in zip(edges, edges[1:], strict=False) if b > a]  # fmt: skip
    np.testing.assert_array_equal(np.concatenate(parts), true)
    assert len(times.says) == 1
