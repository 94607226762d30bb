"""Objects as Python prints them: read back, whatever is no such object refused."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from pprint import pformat
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laid_about import turned

from fieldcal.cli import main
from fieldcal.importing.records.python_text import python_value, values_side_by_side
from fieldcal.session.folder import Session

ROWS = turned(11, 50.0)
START = datetime(2024, 5, 3, 23, 59, 50)  # noqa: DTZ001

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
PLAIN = (int, float, complex, bool, type(None), str, bytes, list, tuple, dict, set,
         type(...))  # fmt: skip
"""Types of what Python reads back without running anything."""

OBJECTS = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text("xyz_'", max_size=3), inner, max_size=3)
    ),
    max_leaves=8,
)


def by_numpy(t: float, row: Any) -> str:
    a, w = (f"array([{', '.join(map(repr, x))}])" for x in (row[:3], row[3:]))
    return f"{{'time': np.float64({t!r}), 'acc': {a}, 'gyro': {w}}}"


def by_datetime(t: float, row: Any) -> str:
    now = START + timedelta(seconds=t)
    return repr({"time": now, "acc": row[:3], "gyro": row[3:]})


def in_pairs(t: float, row: Any) -> str:
    acc, gyr = (dict(zip("xyz", x, strict=True)) for x in (row[:3], row[3:]))
    return f"{acc} {gyr | {'t': t}}"


@pytest.mark.parametrize("line", [by_numpy, by_datetime, in_pairs])
def test_what_a_line_prints_is_a_row(
    tmp_path: Path, line: Callable[[float, Any], str]
) -> None:
    lines = [line(t, row) for t, *row in ROWS.tolist()]
    check(tmp_path, "\n".join(lines))


def test_a_list_may_be_printed_over_many_lines(tmp_path: Path) -> None:
    rows = [{"t": t, "acc": row[:3], "gyro": row[3:]} for t, *row in ROWS.tolist()]
    check(tmp_path, pformat(rows))


def check(folder: Path, text: str) -> None:
    path = folder / "log.txt"
    path.write_text(text + "\n")
    assert main(["import", str(path), "-o", str(folder / "out")]) == 0
    block = Session.open(folder / "out").block
    np.testing.assert_allclose(block.t - block.t[0], ROWS[:, 0], atol=2e-6)
    np.testing.assert_array_equal(block.acc, ROWS[:, 1:4])
    np.testing.assert_array_equal(block.gyr, ROWS[:, 4:])


@given(OBJECTS)
def test_any_object_is_read_back(value: Any) -> None:
    assert python_value(repr(value)) == value


@given(st.text("{}[]()'x:,1.e-n anarray", max_size=30))
def test_any_text_is_an_object_or_none(text: str) -> None:
    for read in (python_value, values_side_by_side):
        try:
            found = read(text)
        except ValueError:
            continue
        assert type(found) in PLAIN
