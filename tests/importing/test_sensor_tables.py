"""Tables of one sensor each, one below the other or in sheets of a workbook."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned
from small_files import write_workbooks

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block
from fieldcal.importers.sensor_tables import recognises
from fieldcal.importing.records.sensor_blocks import sensor_blocks

ROWS = turned(47, 50.0, 2.0)
T = ROWS[:, :1]
ACC, GYR = np.hstack([T, ROWS[:, 1:4]]), np.hstack([T + 0.003, ROWS[:, 4:]])
DEG = np.hstack([GYR[:, :1], np.rad2deg(GYR[:, 1:])])
IN_G = np.hstack([ACC[:, :1], ACC[:, 1:] / G0])


def rows(table: Array, before: str = "", sign: str = ",") -> str:
    lines = (sign.join(f"{x:.9g}" for x in row) for row in table.tolist())
    return "".join(f"{before}{line}\n" for line in lines)


def assert_same(block: Block) -> None:
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=1e-6)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-6)


def half(table: Array) -> tuple[Array, Array]:
    return table[: len(table) // 2], table[len(table) // 2 :]


HEAD = "Time (s),X ({0}),Y ({0}),Z ({0})\n"
WORDS = "sensor,time,x,y,z\n"

TEXTS = {
    "names": f"time,ax,ay,az\n{rows(ACC)}\ntime,gx,gy,gz\n{rows(GYR)}",
    "titles": f"Accelerometer\n{HEAD.format('m/s^2')}{rows(ACC)}\n"
    f"Gyroscope\n{HEAD.format('rad/s')}{rows(GYR)}",
    "titles, no units": f"# Accelerometer\nt,x,y,z\n{rows(ACC)}"
    f"# Gyroscope\nt,x,y,z\n{rows(GYR)}",
    "the gyroscope first, other units": f"# Gyroscope\n{HEAD.format('deg/s')}"
    f"{rows(DEG)}\n# Accelerometer\n{HEAD.format('g')}{rows(IN_G)}",
    "pieces in turn": "".join(
        f"time,ax,ay,az\n{rows(a)}\ntime,gx,gy,gz\n{rows(g)}\n"
        for a, g in zip(half(ACC), half(GYR), strict=True)
    ),
    "words": f"{WORDS}{rows(ACC, 'accelerometer,')}{rows(GYR, 'gyroscope,')}",
    "words alone": rows(ACC, "acc;", ";") + rows(GYR, "gyr;", ";"),
    "titles alone": f"Accelerometer\n{rows(ACC)}Gyroscope\n{rows(GYR)}",
    "matrices in C": "".join(
        f"const float {name}[][4] = {{\n"
        + "".join(f"  {{{line}f}},\n" for line in rows(table).split("\n")[:-1])
        + "};\n"
        for name, table in (("acc", ACC), ("gyro", GYR))
    ),
    "decimal commas": (
        f"time;ax;ay;az\n{rows(ACC, '', ';')}time;gx;gy;gz\n{rows(GYR, '', ';')}"
    ).replace(".", ","),
}


@pytest.mark.parametrize("how", TEXTS)
def test_tables_below_each_other_are_put_side_by_side(how: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(TEXTS[how])
    assert_same(read_files([path])[0])


def test_matrices_of_a_script_have_the_rate_that_it_says(tmp_path: Path) -> None:
    path = tmp_path / "log.m"
    parts = (f"{name} = [\n{rows(table[:, 1:], '', ' ')}];\n".replace("\n", ";\n")
             for name, table in (("acc", ACC), ("gyro", GYR)))  # fmt: skip
    path.write_text("fs = 50;\n" + "".join(parts).replace("[;", "[").replace(";;", ";"))
    assert_same(read_files([path])[0])


def test_a_packed_text_is_looked_through_too(tmp_path: Path) -> None:
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(TEXTS["titles"].encode()))
    assert_same(read_files([path])[0])


def test_sheets_of_a_workbook_are_such_tables(tmp_path: Path) -> None:
    path = tmp_path / "log.xlsx"
    names = {
        "Accelerometer": ["Time (s)", *(f"{x} (m/s^2)" for x in "XYZ")],
        "Gyroscope": ["Time (s)", *(f"{x} (rad/s)" for x in "XYZ")],
    }
    tables = zip(names.items(), (ACC, GYR), strict=True)
    sheets = {n: [head, *table.tolist()] for (n, head), table in tables}
    write_workbooks(path, sheets | {"Metadata Device": [["property", "value"]]})
    assert_same(read_files([path])[0])


@pytest.mark.parametrize(
    "text",
    [
        f"time,ax,ay,az\n{rows(ACC)}",
        f"time,ax,ay,az\n{rows(ACC)}time,ax,ay,az\n{rows(ACC)}",
        f"time,ax,ay,az,gx,gy,gz\n{rows(ROWS)}time,gx,gy,gz\n{rows(GYR)}",
        "".join(
            f"acc,{rows(a[None])}gyr,{rows(g[None])}"
            for a, g in zip(ACC, GYR, strict=True)
        ),
    ],
    ids=["one sensor", "a piece", "both at the top", "lines in turn"],
)
def test_other_texts_are_left_to_their_reader(text: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text)
    assert not recognises(path.read_bytes()[:4096], path)


@given(st.text(alphabet="accgyr,;xyz012. #\n", max_size=300))
def test_no_text_breaks_the_reader(text: str) -> None:
    for one in sensor_blocks((TEXTS["titles"][:300] + text).splitlines()):
        assert len(one.names) >= 3
