"""Variables that Octave saves as text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importers.octave_text import read_variables

ROWS = turned(51, 50.0, 2.0, sides=7)
TOP = "# Created by Octave 6.4.0, Mon Jan 05 12:00:00 2026 UTC <me@pc>\n"


def matrix(name: str, values: Array) -> str:
    table = values.reshape(len(values), -1)
    head = f"# name: {name}\n# type: matrix\n# rows: {len(table)}\n"
    lines = [" " + " ".join(f"{x:.10g}" for x in row) for row in table]
    return f"{head}# columns: {table.shape[1]}\n" + "\n".join(lines) + "\n\n\n"


def variables(with_times: bool) -> str:
    rate = "# name: fs\n# type: scalar\n50\n\n\n"
    note = "# name: note\n# type: string\n# elements: 1\n# length: 4\nlain\n\n\n"
    times = matrix("t", ROWS[:, 0]) if with_times else rate
    return TOP + note + times + matrix("acc", ROWS[:, 1:4]) + matrix("gyr", ROWS[:, 4:])


@pytest.mark.parametrize("with_times", [True, False])
def test_matrices_are_read_side_by_side(with_times: bool, tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    path.write_text(variables(with_times))
    block, _ = read_files([path])
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=1e-9)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-8)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-8)


def test_one_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    path.write_text("\n".join(variables(True).split("\n")[:-200]))
    with pytest.raises(
        InputError, match="log.mat: variable gyr: has not 1150 rows of 3"
    ):
        read_files([path])


def test_one_whose_number_of_rows_is_damaged_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    path.write_text(variables(True).replace("# rows: 1150", "# rows: \0", 1))
    with pytest.raises(InputError, match="variable t: has not 0 rows of 1 numbers"):
        read_files([path])


@given(st.text(alphabet="# name:typerowscolumnsmatrix0123 \n", max_size=300))
def test_no_text_breaks_the_reader(text: str) -> None:
    try:
        read_variables((variables(True) + text).splitlines())
    except InputError as error:
        assert "variable" in str(error)
