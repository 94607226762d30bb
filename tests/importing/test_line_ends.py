"""Ends of lines and of files as programs and devices leave them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned, write

ROWS = turned(13, 50.0, 1.0)
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
