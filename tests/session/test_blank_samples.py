"""Rows of zeros in the place of samples that were lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from fieldcal.core.samples import Block
from fieldcal.session import sample_files
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


def recorded(folder: Path, block: Block) -> Path:
    columns = dict(zip(("ax", "ay", "az", "gx", "gy", "gz"), block.six.T, strict=True))
    table = pa.table({"t": block.t, **columns})
    pa.parquet.write_table(table, folder / "samples.parquet")
    (folder / "session.toml").write_text("format = 1\n")
    return folder


@pytest.mark.parametrize("rows_at_once", [1 << 17, 10])
def test_a_session_says_so_and_reads_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows_at_once: int
) -> None:
    """Whole or part by part, of which one holds a single row of zeros."""
    monkeypatch.setattr(sample_files, "ROWS_AT_ONCE", rows_at_once)
    recorded(tmp_path, samples())
    whole, parts = Session.open(tmp_path), Session.open(tmp_path)
    assert len(whole.block) == 97
    (said,) = whole.warnings
    assert said.startswith("3 samples are zero in all outputs")
    t = np.concatenate([part.t for part in parts.blocks()])
    np.testing.assert_allclose(t, whole.block.t)
    assert parts.warnings == (said,)


def test_a_device_that_begins_with_zeros_is_read_alike_whole_and_in_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A part that holds nothing but zeros is no device that puts out nothing else."""
    monkeypatch.setattr(sample_files, "ROWS_AT_ONCE", 10)
    block = samples()
    block.acc[:25] = block.gyr[:25] = 0.0
    recorded(tmp_path, block)
    whole, parts = Session.open(tmp_path), Session.open(tmp_path)
    t = np.concatenate([part.t for part in parts.blocks()])
    np.testing.assert_allclose(t, whole.block.t)
    assert parts.warnings == whole.warnings and whole.warnings[0].startswith("26 ")
