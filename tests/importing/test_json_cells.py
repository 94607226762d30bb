"""Records in JSON within the cells of a table, and behind a bare number."""

from __future__ import annotations

import csv
import io
import json
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from closed_circle import one_in
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned

from fieldcal.importing.records.json_cells import cell_names, record_in_cells

ROWS = turned(13, 50.0, 2.0)
SIX = ("ax", "ay", "az", "gx", "gy", "gz")
BEGAN = datetime(2024, 5, 3, 14, 20, 31)


def record(row: list[float], nested: bool) -> str:
    if not nested:
        return json.dumps(dict(zip(SIX, row[1:], strict=True)))
    three = [dict(zip("xyz", part, strict=True)) for part in (row[1:4], row[4:])]
    return json.dumps(dict(zip(("accel", "gyro"), three, strict=True)))


@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize("stamped", [False, True])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_cell_may_hold_the_record(
    tmp_path: Path, nested: bool, stamped: bool, separator: str
) -> None:
    text = io.StringIO()
    table = csv.writer(text, delimiter=separator)
    table.writerow(["created_at" if stamped else "time", "topic", "payload"])
    for row in ROWS.tolist():
        at = BEGAN + timedelta(seconds=row[0])
        first = at.isoformat(timespec="microseconds") if stamped else f"{row[0]:.4f}"
        table.writerow([first, "lab/imu", record(row, nested)])
    path = tmp_path / "export.csv"
    path.write_text(text.getvalue())
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), 0.02, atol=2e-6)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4])
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:])


FORMS = {
    "labels": "ax:{} ay:{} az:{} gx:{} gy:{} gz:{}",
    "equal": "ax={},ay={},az={},gx={},gy={},gz={}",
    "vectors": "acc: [{}, {}, {}] gyro: [{}, {}, {}]",
    "json": '{{"ax": {}, "ay": {}, "az": {}, "gx": {}, "gy": {}, "gz": {}}}',
}


@pytest.mark.parametrize(
    ("before", "form"),
    one_in(3, [
        ("{:.0f} ", "labels"), ("{:.0f},", "equal"), ("{:.0f}, ", "labels"),
        ("{:.0f}: ", "vectors"), ("{:.0f} ", "json"), ("{:.0f} | ", "vectors"),
        ("{:.0f},", "json"), ("{:.0f} > ", "equal"), ("({:.0f}) ", "labels"),
        ("{:.0f}\t", "equal"),
    ]),
)  # fmt: skip
def test_a_bare_number_before_what_has_names_is_the_time(
    tmp_path: Path, before: str, form: str
) -> None:
    lines = [
        before.format(1234 + 1e3 * row[0]) + FORMS[form].format(*row[1:])
        for row in ROWS.tolist()
    ]
    path = tmp_path / "log.txt"
    path.write_text("\n".join(lines) + "\n")
    block, _ = read_files([path])
    np.testing.assert_allclose(np.diff(block.t), 0.02, atol=1.1e-3)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4])
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:])


@given(st.dictionaries(st.text(max_size=5), st.floats(allow_nan=False), min_size=1))
def test_a_record_comes_out_of_its_cell_as_it_went_in(inner: dict[str, float]) -> None:
    text = io.StringIO()
    csv.writer(text).writerow(["7", json.dumps(inner)])
    found = record_in_cells(text.getvalue(), ["number of the row", "data"])
    assert found == {"number of the row": 7.0} | inner


@given(st.text(alphabet='{}",:;\t0a[] ', max_size=40))
def test_no_line_breaks_the_search_for_a_record(line: str) -> None:
    found = record_in_cells(line)
    assert found is None or isinstance(found, dict)
    assert isinstance(cell_names(line), list)
