"""Rows of a matrix as programs and databases write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned

from fieldcal.importing.text.matrix_rows import MatrixRows

ROWS = turned(53, 50.0, 2.0)
NAMES = ("t", "ax", "ay", "az", "gx", "gy", "gz")


def within(opens: str, closes: str, end: str = "") -> list[str]:
    rows = (f"{end}, ".join(f"{x:.9g}" for x in row) for row in ROWS.tolist())
    return [f"{opens}{row}{end}{closes}" for row in rows]


def numpy_text() -> str:
    lines = within("       [", "],")
    return "array([" + "\n".join(lines).strip()[:-1] + "])\n"


def made() -> str:
    columns = ",\n".join(f"  `{name}` double DEFAULT NULL" for name in NAMES)
    lines = ",\n".join(within("(", ")"))
    table = f"CREATE TABLE `imu` (\n{columns}\n) ENGINE=InnoDB;"
    return f"{table}\nINSERT INTO `imu` VALUES {lines};\n"


TEXTS = {
    "C": "const float imu[][7] = {\n" + "\n".join(within("  {", "},", "f")) + "\n};\n",
    "NumPy": numpy_text(),
    "put in": "\n".join(within(f"INSERT INTO imu ({', '.join(NAMES)}) VALUES (", ");")),
    "made": made(),
}


@pytest.mark.parametrize("how", TEXTS)
def test_every_row_is_read(how: str, tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(TEXTS[how])
    block, _ = read_files([path])
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=1e-9)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("how", ["put in", "made"])
def test_names_are_those_of_the_table(how: str) -> None:
    form = MatrixRows.of(TEXTS[how].splitlines()[:40], None)
    assert form is not None
    assert form.names == NAMES


@pytest.mark.parametrize("line", ["acc: [0.1, 0.2, 9.8]", "0.1,0.2,9.8", "[0.1, 0.2]"])
def test_other_lines_are_left(line: str) -> None:
    assert MatrixRows.of([line] * 9, None) is None


@given(st.text(alphabet="{}[]()0.1,;fF INSERTVALUESarray=-e\n", max_size=200))
def test_no_text_breaks_the_reader(text: str) -> None:
    form = MatrixRows.of(within("{", "}")[:20], None)
    assert form is not None
    assert isinstance(form.reader()(text.splitlines()), list)
