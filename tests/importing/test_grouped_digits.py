"""Thousands that spreadsheets set apart are no decimals, and decimals no thousands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from joined import read_files
from laid_about import G, turned

from fieldcal.core.samples import Block
from fieldcal.importing.text.grouped_digits import SIGNS, GroupedDigits

ROWS = turned(12, 50.0, 2.0)
MS = np.round(1e3 * ROWS[:, 0]).astype(int).tolist()
COUNTS = np.round(
    np.hstack([ROWS[:, 1:4] * 16384 / G, np.rad2deg(ROWS[:, 4:]) * 131.072])
).astype(int)


def shown(number: int, sign: str) -> str:
    return f"{number:,}".replace(",", sign)


def imported(
    folder: Path, rows: list[list[str]], separator: str
) -> tuple[Block, list[str]]:
    path = folder / "log.csv"
    head = separator.join(["t_ms", "ax", "ay", "az", "gx", "gy", "gz"])
    text = "\n".join([head, *(separator.join(row) for row in rows)])
    path.write_text(text + "\n", encoding="utf-8")
    return read_files([path])


def assert_is_motion(block: Block) -> None:
    np.testing.assert_allclose(block.t - block.t[0], ROWS[:, 0], atol=1e-3)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-3)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-3)


@pytest.mark.parametrize("sign", SIGNS)
def test_counts_of_a_spreadsheet_are_whole_numbers(tmp_path: Path, sign: str) -> None:
    rows = [[shown(n, sign) for n in (ms, *counts)]
            for ms, counts in zip(MS, COUNTS.tolist(), strict=True)]  # fmt: skip
    if sign == ",":
        # in quotes, as a comma parts the columns
        rows = [[f'"{cell}"' if sign in cell else cell for cell in row] for row in rows]
    block, says = imported(tmp_path, rows, "," if sign == "," else ";")
    assert_is_motion(block)
    assert [one for one in says if "between thousands" in one]


@given(st.lists(st.integers(-(10**10), 10**10), min_size=8), st.sampled_from(SIGNS))
def test_whole_numbers_are_read_as_they_were_written(
    numbers: list[int], sign: str
) -> None:
    lines = [f"{i};{shown(n, sign)}" for i, n in enumerate(numbers)]
    form = GroupedDigits.of(lines, None)
    parted = [n for n in numbers if abs(n) >= 1000]
    if len(parted) < 3 or (sign in ",." and max(map(abs, parted)) < 10**6):
        return  # it may not be told
    assert form is not None
    assert form.reader()(lines) == [f"{i};{n}" for i, n in enumerate(numbers)]


@given(
    st.lists(st.floats(-2e3, 2e3), min_size=4),
    st.sampled_from([",", "."]),
    st.booleans(),
)
def test_decimals_are_no_thousands(
    numbers: list[float], sign: str, zeros: bool
) -> None:
    """Three digits behind the sign in all rows, or without the zeros at the end."""
    texts = [f"{n:.3f}" if zeros else f"{round(n, 3)!r}" for n in numbers]
    lines = [f"{i};{text.replace('.', sign)}" for i, text in enumerate(texts)]
    assert GroupedDigits.of(lines, None) is None


def test_three_numbers_in_a_cell_are_no_thousands() -> None:
    cells = ["490 504 539", "491 503 540", "-12 503 541", "490 3 542", "488 505 540"]
    assert GroupedDigits.of([f"{i};{c}" for i, c in enumerate(cells)], None) is None


@example(["0 000", "0 000", "0 000"])
@given(st.lists(st.text(alphabet="0123456789 .,;'-x", max_size=12), max_size=9))
def test_any_cells_are_grouped_digits_or_are_not(cells: list[str]) -> None:
    """Numbers that stand behind spaces have no sign between thousands."""
    lines = [f"0;{cell}" for cell in cells] + ["0; 12", "0; 13", "0; -14"]
    form = GroupedDigits.of(lines, None)
    assert form is None or len(form.reader()(lines)) == len(lines)
