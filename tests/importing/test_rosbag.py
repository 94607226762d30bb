"""Bags of ROS 1 and ROS 2, written by a library."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from bags import TOPIC, bag
from laid_about import turned

from fieldcal.cli import main
from fieldcal.session.folder import Session


@pytest.mark.parametrize("first", [True, False])
def test_a_bag_is_read_with_the_temperature_of_its_frame(
    first: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(1, 20.0)
    path = bag(tmp_path, rows, first)
    out = tmp_path / "out"
    assert main(["import", str(path), "--list"]) == 0
    assert TOPIC in capsys.readouterr().out
    assert main(["import", str(path), "-o", str(out)]) == 0
    block = Session.open(out).block
    np.testing.assert_allclose(block.t, rows[:, 0], atol=1e-6)
    np.testing.assert_allclose(block.acc, rows[:, 1:4])
    np.testing.assert_allclose(block.gyr, rows[:, 4:])
    assert (block.temperature == 31.5).all()


@pytest.mark.parametrize("first", [True, False])
def test_messages_without_a_stamp_have_the_time_of_their_logging(
    first: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = turned(1, 20.0)
    path = bag(tmp_path, rows, first, stamped=False)
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 0
    assert "headers of its messages have no stamp" in capsys.readouterr().err
    block = Session.open(tmp_path / "out").block
    np.testing.assert_allclose(np.diff(block.t), np.diff(rows[:, 0]), atol=1e-6)
    np.testing.assert_allclose(block.acc, rows[:, 1:4])


@pytest.mark.parametrize("first", [True, False])
def test_a_bag_that_was_cut_off_is_one_sentence(
    first: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = bag(tmp_path, turned(2, 20.0), first)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "cannot be read" in said and said.count("\n") == 1


def test_a_message_of_ros_2_without_a_time_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A database takes what damage leaves: here the first message has no time."""
    path = bag(tmp_path, turned(2, 20.0), first=False)
    with closing(sqlite3.connect(path)) as base:
        base.executescript(
            "CREATE TABLE found AS SELECT * FROM messages;"
            "DROP TABLE messages; ALTER TABLE found RENAME TO messages;"
            "UPDATE messages SET timestamp = NULL WHERE rowid = 1;"
        )
    assert main(["import", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "message 1" in said and "cannot be read" in said and said.count("\n") == 1
