"""Rows of zeros in the place of samples that were lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from fieldcal.core.samples import Block
from fieldcal.session.blank_samples import remove_blank_samples
from fieldcal.session.folder import Session

BLANK = [7, 8, 40]


def samples(gyroscopes: bool = True) -> Block:
    rng = np.random.default_rng(2)
    acc = rng.normal(0, 0.02, (100, 3)) - [0.0, 9.8, 0.0]
    gyr = rng.normal(0, 1e-3, (100, 3)) if gyroscopes else np.full((100, 3), np.nan)
    acc[BLANK] = 0.0
    if gyroscopes:
        gyr[BLANK] = 0.0
    return Block.of(np.arange(100) / 50.0, acc, gyr)


@pytest.mark.parametrize("gyroscopes", [True, False])
def test_rows_of_zeros_are_left_out(gyroscopes: bool) -> None:
    block = samples(gyroscopes)
    kept, count = remove_blank_samples(block)
    assert count == len(BLANK)
    np.testing.assert_array_equal(kept.t, np.delete(block.t, BLANK))
    np.testing.assert_array_equal(kept.six, np.delete(block.six, BLANK, axis=0))


def test_outputs_of_which_some_are_zero_are_a_device_s() -> None:
    """Gyroscopes with a dead band, one axis that is level, and nothing else at all."""
    block = samples()
    still = Block.of(block.t, block.acc - [0, 9.8, 0], np.zeros((100, 3)))
    assert remove_blank_samples(still) == (still, 0)
    level = Block.of(block.t, np.where([1, 0, 1], 0.0, still.acc), block.gyr + 1e-3)
    assert remove_blank_samples(level) == (level, 0)
    nothing = Block.of(block.t, np.zeros((100, 3)), np.zeros((100, 3)))
    assert remove_blank_samples(nothing) == (nothing, 0)


def test_a_session_says_so_and_reads_on(tmp_path: Path) -> None:
    block = samples()
    columns = dict(zip(("ax", "ay", "az", "gx", "gy", "gz"), block.six.T, strict=True))
    table = pa.table({"t": block.t, **columns})
    pa.parquet.write_table(table, tmp_path / "samples.parquet")
    (tmp_path / "session.toml").write_text("format = 1\n")
    session = Session.open(tmp_path)
    assert len(session.block) == 97
    (said,) = session.warnings
    assert said.startswith("3 samples are zero in all outputs")
    parts = np.concatenate([part.t for part in Session.open(tmp_path).blocks()])
    np.testing.assert_allclose(parts, session.block.t)
