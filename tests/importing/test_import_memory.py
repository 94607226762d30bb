"""What importing keeps of a recording does not grow with it."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.importing.files.spool import IN_MEMORY, SpooledRows
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import ImuStream, Recording
from fieldcal.importing.session.ingest import import_stream
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.session.folder import Session
from fieldcal.windows import still_stretches

RATE, REST = 10.0, 300.0


class Long(Recording):
    """A device that is turned every five minutes, for so many hours."""

    hours = 1.0

    def streams(self) -> list[ImuStream]:
        return [ImuStream("0", "")]

    def blocks(self, stream: str) -> Iterator[Block]:
        n = int(REST * RATE)
        for k in range(int(self.hours * 3600 / REST)):
            rng = np.random.default_rng(k)
            acc = rng.normal(0, 0.02, (n, 3)) + [k % 3, 1 - k % 3, 9.8]
            gyr = rng.normal(0, 1e-3, (n, 3))
            gyr[:20] += 0.2
            yield Block.of((k * n + np.arange(n)) / RATE, acc, gyr)


def peak(folder: Path, hours: float) -> tuple[int, int]:
    """Most bytes at once, and how many stretches were found."""
    (folder / "log").write_bytes(b"log")
    recording = Long(folder / "log", ReadOptions())
    recording.hours = hours
    tracemalloc.start()
    try:
        imported = import_stream(
            recording, "0", folder / f"{hours}", {"format": 1}, 60.0
        )
        return tracemalloc.get_traced_memory()[1], len(imported.rests)
    finally:
        tracemalloc.stop()


@pytest.mark.thorough
def test_three_hours_take_no_more_memory_than_half_of_one(tmp_path: Path) -> None:
    peak(tmp_path, 0.25)
    short, few = peak(tmp_path, 0.5)
    long, many = peak(tmp_path, 3.0)
    assert (few, many) == (6, 36)
    # what three hours of cells would take by themselves
    assert 35 * 8 * 3 * 36_000 > 10 * IN_MEMORY
    assert long < 1.1 * short


@pytest.mark.thorough
def test_stretches_of_a_stream_are_those_of_its_samples(tmp_path: Path) -> None:
    peak(tmp_path, 1.0)
    session = Session.open(tmp_path / "1.0")
    there = still_stretches(session.block, 60.0)
    windows = [window for window in session.windows if window]
    np.testing.assert_allclose(np.array(windows), np.array(there), atol=1e-6)


def test_what_is_put_aside_comes_back(tmp_path: Path) -> None:
    rows = np.arange(3.0 * (IN_MEMORY // 12)).reshape(-1, 3)
    with SpooledRows(tmp_path) as spilled:
        for part in np.array_split(rows, 7):
            spilled.add(part)
        assert len(spilled) == len(rows)
        np.testing.assert_array_equal(spilled[5:9], rows[5:9])
        np.testing.assert_array_equal(spilled[len(rows) - 3 : len(rows) + 9], rows[-3:])
        assert not len(spilled[7:3])
    assert not list(tmp_path.iterdir())


def test_of_a_log_that_is_bad_all_over_only_the_number_is_kept(tmp_path: Path) -> None:
    recording = Long(tmp_path / "x", ReadOptions(), repair=True)
    for i in range(1000):
        recording.damaged(f"byte {i}", "is no message")
    assert len(recording.mended) == 13
    assert recording.mended[-1] == "988 more damaged places, left out"
    with pytest.raises(InputError, match="byte 5: is no message; copy"):
        Long(tmp_path / "x", ReadOptions()).damaged("byte 5", "is no message")
    judge = RowValidator("x", lambda row: f"row {row}", repair=True)
    t = np.arange(4000.0)
    acc = np.ones((4000, 3))
    acc[::2, 0] = np.inf
    pieces = (Block.of(t[i : i + 50], acc[i : i + 50]) for i in range(0, 4000, 50))
    kept = sum(map(len, judge.through(pieces)))
    assert kept == 2000 and judge.left_out == 2000
    assert len(judge.mended) == 13
    assert judge.mended[-1] == "1988 more rows in 1988 more places, left out"
