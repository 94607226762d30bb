"""Lines and ends of files as programs and devices leave them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned, write

from fieldcal.core.errors import InputError

ROWS = turned(13, 50.0, 1.0, sides=7)
HEAD = "t,ax,ay,az,gx,gy,gz"


def lines(folder: Path, quoted: bool = False) -> list[str]:
    found = write(folder, ROWS, heading=HEAD).read_text().splitlines()
    return [f'"{line.replace(",", chr(34) + "," + chr(34))}"' if quoted else line
            for line in found]  # fmt: skip


@pytest.mark.parametrize("quoted", [False, True])
def test_each_line_may_end_otherwise(tmp_path: Path, quoted: bool) -> None:
    ends = ("\r\n", "\n", "\r")
    text = "".join(f"{x}{ends[i % 3]}" for i, x in enumerate(lines(tmp_path, quoted)))
    (tmp_path / "log.csv").write_bytes(text.encode())
    block, _ = read_files([tmp_path / "log.csv"])
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-6)


@pytest.mark.parametrize("fill", [b"\0", b"\xff"])
@pytest.mark.parametrize(("cut", "whole"), [(0, len(ROWS)), (9, len(ROWS) - 1)])
def test_a_file_that_a_device_did_not_fill_ends_with_its_last_whole_line(
    tmp_path: Path, fill: bytes, cut: int, whole: int
) -> None:
    """A number that was cut off would be another number."""
    text = "\n".join([*lines(tmp_path), ""]).encode()
    path = tmp_path / "log.csv"
    path.write_bytes(text[: len(text) - cut] + fill * 3_000_000)
    block, says = read_files([path])
    np.testing.assert_allclose(block.six, ROWS[:whole, 1:], atol=1e-6)
    assert [one for one in says if "behind its last whole line" in one]


@pytest.mark.parametrize("mark", ["# 12345", "// mark 12345", "% 3 of 12345 done"])
def test_comments_between_rows_are_no_rows(tmp_path: Path, mark: str) -> None:
    text = lines(tmp_path)
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*text[:100], mark, *text[100:]]) + "\n")
    block, says = read_files([path])
    np.testing.assert_allclose(block.six, ROWS[:, 1:], atol=1e-6)
    assert "lines of words between its rows: 1" in says


@pytest.mark.parametrize("word", ["--", "?", "1.#QNAN", "-1.#IND00"])
def test_a_cell_without_a_value_says_so_in_many_ways(tmp_path: Path, word: str) -> None:
    text = lines(tmp_path)
    text[9] = ",".join([*text[9].split(",")[:-1], word])
    path = tmp_path / "log.csv"
    path.write_text("\n".join(text) + "\n")
    block, _ = read_files([path])
    assert np.flatnonzero(np.isnan(block.six).any(axis=1)).tolist() == [8]


def test_times_of_too_few_digits_are_no_times(tmp_path: Path) -> None:
    """Of 32 bits, the seconds since 1970 step by 128 s."""
    rows = ROWS.copy()
    rows[:, 0] = (rows[:, 0] + 1714746048 - 10).astype(np.float32)
    assert len(np.unique(rows[:, 0])) == 2
    with pytest.raises(InputError, match="written with too few digits.*give --rate"):
        read_files([write(tmp_path, rows, heading=HEAD)])
