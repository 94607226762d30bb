"""Files whose first two lines are a time and a rate, once a column."""

from __future__ import annotations

import doctest
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laid_about import turned, write

from fieldcal.cli import main
from fieldcal.importing.text import rate_on_top
from fieldcal.importing.text.rate_on_top import RateOnTop
from fieldcal.session.folder import Session

BEGAN = 1.7e9


def test_each_row_has_its_time(tmp_path: Path) -> None:
    rows = turned(8, 32.0, hold=5.0)[:, :4]
    top = np.array([[BEGAN] * 3, [32.0] * 3])
    path = write(tmp_path, np.vstack([top, rows[:, 1:]]), "ACC.csv")
    folder = tmp_path / "s"
    assert (
        main(["import", str(path), "--columns", "t,ax,ay,az", "-o", str(folder)]) == 0
    )
    block = Session.open(folder).block
    np.testing.assert_allclose(block.t - block.t[0], rows[:, 0], atol=1e-5)
    np.testing.assert_allclose(block.acc, rows[:, 1:], rtol=1e-8)


@given(st.lists(st.integers(0, 40), max_size=4))
def test_it_is_no_matter_how_the_lines_come(cuts: list[int]) -> None:
    lines = [f"{BEGAN:.1f}," * 2 + f"{BEGAN:.1f}", "4.0,4.0,4.0"]
    lines += [f"{i},0,1" for i in range(38)]
    edges = [0, *sorted(cuts), len(lines)]
    read = RateOnTop().reader()
    pieces = [lines[a:b] for a, b in zip(edges, edges[1:], strict=False)]
    found = [row for piece in pieces for row in read(piece)]
    assert found == [f"{BEGAN + i / 4:.6f},{i},0,1" for i in range(38)]


@pytest.mark.parametrize(
    "lines",
    [["1,1,1", "32,32,32"], ["1.7e9,1.7e9,1.7e9", "32,32,32"],
     ["1700000000,1700000000,1700000000", "32,32,33"],
     ["1700000000,1700000000,1700000000"], ["1700000000,1700000000", "32,32"],
     ["1700000000,1700000000,1700000000", "0,0,0"]],
)  # fmt: skip
def test_other_lines_are_no_such_beginning(lines: list[str]) -> None:
    assert RateOnTop.of(lines, None) is None


def test_examples() -> None:
    failed, tried = doctest.testmod(rate_on_top)
    assert tried and not failed
