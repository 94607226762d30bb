"""A damaged samples file: what is said of it, what is kept, and what it is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fieldcal.acceptance.run_facts import link_counts
from fieldcal.core.errors import SessionError
from fieldcal.core.samples import Block
from fieldcal.diagnosis.signal.chain import samples_to_check
from fieldcal.effects.dropped import Dropped
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.session.recorder import SAMPLES, Recorder

ABOUT = {
    "format": 1,
    "position": [{"alpha_deg": 0.0, "beta_deg": 0.0}, {"name": "other"}],
}
BATCHES, ROWS, HZ = 20, 100, 100.0


def batch(i: int) -> Block:
    """The i-th second of a device at rest."""
    rng = np.random.default_rng(i)
    t = (i * ROWS + np.arange(ROWS)) / HZ
    acc = rng.normal(0, 0.01, (ROWS, 3)) + [0, -9.8, 0]
    return Block.of(t, acc, rng.normal(0, 1e-3, (ROWS, 3)), t_host=t)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A session of twenty seconds, nearly all of it one window."""
    with Recorder(tmp_path / "s", ABOUT) as recorder:
        for i in range(BATCHES):
            recorder.append(batch(i))
            recorder.flush()
        recorder.mark("window", position=0, start_s=0.5, end_s=19.5)
    return tmp_path / "s"


def spoil(folder: Path, first: int, end: int) -> bytes:
    """Write zeros over so many twentieths of the samples; returns what was there."""
    path = folder / SAMPLES
    data = path.read_bytes()
    a, b = (len(data) * i // BATCHES for i in (first, end))
    path.write_bytes(data[:a] + bytes(b - a) + data[b:])
    return data


def drop(folder: Path, lost: slice) -> None:
    """Record the session anew, without some rows that the link lost."""
    block = Session.open(folder).block
    kept = np.delete(np.arange(len(block)), np.arange(len(block))[lost])
    (folder / SAMPLES).unlink()
    (folder / "session.toml").rename(folder / "kept.toml")
    marks = (folder / "marks.jsonl").read_bytes()
    (folder / "marks.jsonl").unlink()
    with Recorder(folder, ABOUT) as recorder:
        recorder.append(block[kept])
    (folder / "marks.jsonl").write_bytes(marks)


def losses(folder: Path) -> tuple[int, int]:
    """Samples that the link lost, as the decision and the diagnosis count them."""
    session = Session.open(folder)
    windows = usable_windows(session).averages
    missing = link_counts(session, windows, list(session.marks()))["missing"]
    usable = np.ones(len(session.block), dtype=bool)
    faults = Dropped().find(samples_to_check(session.block, usable, session.about))
    return missing, len(faults)


def test_what_is_damaged_in_a_file_was_not_lost_on_the_link(folder: Path) -> None:
    assert losses(folder) == (0, 0)
    spoil(folder, 8, 10)
    session = Session.open(folder)
    # three batches are touched, of rows 701 to 1000
    assert len(session.block) == (BATCHES - 3) * ROWS
    (says,) = session.warnings
    assert says.startswith(
        "samples.arrows: rows 701 to 1000 between 6.99 and 10.00 s are damaged or"
        " missing, and left out: if the file was copied, copy it again"
    )
    ((start, end),) = session.about.excluded_spans
    assert 6.99 < start < 6.99 + 1e-9 and end == 10.0
    assert losses(folder) == (0, 0)


def test_what_the_link_lost_is_counted(folder: Path) -> None:
    drop(folder, slice(700, 1000))
    assert losses(folder) == (300, 1)


def test_a_run_that_goes_on_keeps_what_stands_behind_damage(folder: Path) -> None:
    spoil(folder, 4, 6)
    before = Session.open(folder).block
    assert before.t[-1] == batch(BATCHES - 1).t[-1]
    with Recorder(folder, None) as recorder:
        recorder.append(batch(BATCHES + 5))
    after = Session.open(folder)
    np.testing.assert_array_equal(after.block.t[: len(before)], before.t)
    assert len(after.block) == len(before) + ROWS
    assert [s.partition(" between")[0] for s in after.warnings] == [
        "samples.arrows: rows 301 to 600"
    ]


def test_a_copy_of_a_damaged_batch_costs_no_other_one(folder: Path) -> None:
    """A batch that is there twice, once with a changed byte, hides none behind it."""
    data = (folder / SAMPLES).read_bytes()
    ends = [data.find(b"crc32", 0)]
    while (more := data.find(b"crc32", ends[-1] + 1)) >= 0:
        ends.append(more)
    length = ends[2] - ends[1]
    begins = data.rfind(b"\xff\xff\xff\xff", 0, ends[2])
    copy = bytearray(data[begins : begins + length])
    copy[-5] ^= 1
    (folder / SAMPLES).write_bytes(data[:begins] + copy + data[begins:])
    session = Session.open(folder)
    assert len(session.block) == BATCHES * ROWS
    (says,) = session.warnings
    assert says.startswith("samples.arrows: bytes ")


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (bytes(5000), "consists of 5000 zeros, as after a power cut"),
        (b"t,ax,ay,az\n0.0,1,2,3\n", "is text and no Arrow stream: name it"),
        (bytes(range(1, 256)) * 9, "nothing in it can be read; copy it again"),
    ],
)
def test_a_file_of_which_nothing_can_be_read_is_kept(
    folder: Path, data: bytes, says: str
) -> None:
    path = folder / SAMPLES
    path.write_bytes(data)
    with pytest.raises(SessionError, match="samples.arrows: ") as told:
        _ = Session.open(folder).block
    assert says in str(told.value)
    with pytest.raises(SessionError, match="delete this file first") as told:
        Recorder(folder, None)
    assert says in str(told.value)
    assert path.read_bytes() == data
    path.unlink()
    with Recorder(folder, None) as recorder:
        recorder.append(batch(0))
    assert len(Session.open(folder).block) == ROWS


def test_a_run_adds_no_second_samples_file(folder: Path) -> None:
    (folder / SAMPLES).unlink()
    (folder / "samples.csv").write_text("t,ax,ay,az\n0,0,-9.8,0\n")
    with pytest.raises(SessionError, match=r"samples.csv: a run goes on with samples"):
        Recorder(folder, None)
    assert not (folder / SAMPLES).exists()
    assert len(Session.open(folder).block) == 1


def test_zeros_in_a_text_file_are_told_as_such(folder: Path) -> None:
    (folder / SAMPLES).unlink()
    (folder / "samples.csv").write_bytes(
        b"t,ax,ay,az\n0,0,-9.8,0\n1,0,\0\0\0\0,-9.8,0\n2,0,-9.8,0\n"
    )
    with pytest.raises(SessionError, match="row 2 holds 4 zero bytes, as after a po"):
        _ = Session.open(folder).block


@pytest.mark.parametrize(
    ("size", "says"),
    [(0, "is empty, as after a power cut"), (300, "holds no whole sample: it was cut")],
)
def test_a_run_that_was_killed_in_its_first_batch_goes_on(
    folder: Path, size: int, says: str
) -> None:
    path = folder / SAMPLES
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(SessionError, match=says):
        _ = Session.open(folder).block
    with Recorder(folder, None) as recorder:
        recorder.append(batch(0))
    assert len(Session.open(folder).block) == ROWS


@pytest.mark.parametrize(
    ("keep", "says"),
    [
        (0.5, "was cut off after 9.99 s, as by a kill or an incomplete copy; its 1000"),
        (1.0, ""),
    ],
)
def test_a_cut_is_told_with_its_time(folder: Path, keep: float, says: str) -> None:
    path = folder / SAMPLES
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * keep) + 400 if says else len(data)])
    session = Session.open(folder)
    assert session.block.t[-1] == (9.99 if says else 19.99)
    assert bool(session.warnings) == bool(says)
    assert says in "".join(session.warnings)
