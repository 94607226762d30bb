"""Files of which a part is in another unit, or at another full scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laid_about import G, turned, write

from fieldcal.cli import main
from fieldcal.importing.units.changed_unit import changed_unit

ROWS = turned(31, 50.0, 2.0)
HEAD = "t,ax,ay,az,gx,gy,gz"
STATED = "t,ax [m/s^2],ay [m/s^2],az [m/s^2],gx,gy,gz"


@pytest.mark.parametrize("head", [HEAD, STATED])
@pytest.mark.parametrize("ratio", [1 / G, 1000 / G, G])
def test_a_part_in_another_unit_is_refused(
    ratio: float, head: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = ROWS.copy()
    rows[500:, 1:4] *= ratio
    path = write(tmp_path, rows, heading=head)
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "its unit or its full scale changes there" in said
    row = int(said.partition("up to row ")[2].split()[0])
    assert 500 <= row <= 500 + 3 * 50


def test_counts_at_another_full_scale_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = ROWS.copy()
    rows[:, 1:4] = np.round(rows[:, 1:4] * 16384 / G)
    rows[600:, 1:4] = np.round(rows[600:, 1:4] / 4)
    path = write(tmp_path, rows, heading=HEAD)
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "its full scale changes there" in capsys.readouterr().err


@given(
    st.floats(-2.4, 2.4), st.floats(-2.4, 2.4), st.floats(-2.4, 2.4),
    st.floats(1e-3, 1e4), st.integers(0, len(ROWS) - 200), st.integers(200, len(ROWS)),
)  # fmt: skip
def test_no_bias_is_a_change_of_the_unit(
    x: float, y: float, z: float, scale: float, first: int, many: int
) -> None:
    acc = (ROWS[first : first + many, 1:4] + [x, y, z]) * scale
    assert changed_unit(acc) is None
