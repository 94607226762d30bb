"""What is left of a session after a kill, a full disk, a cut or a changed byte."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from processes import Recalibrated
from recorded import block, faults, killed, moments, same

from fieldcal.cli import main
from fieldcal.core.errors import SessionError
from fieldcal.core.samples import Block
from fieldcal.session import sample_files, sample_table
from fieldcal.session.arrow_stream import decode_stream
from fieldcal.session.folder import Session
from fieldcal.session.integrity import file_faults
from fieldcal.session.recorder import Recorder

BATCHES, ROWS = 4, 3
ABOUT = {"format": 1, "device": {"name": "bench"}, "position": [{"name": "home"}]}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[int]]:
    """A small session, and the sizes its samples had after each batch."""
    folder, sizes = tmp_path_factory.mktemp("recorded") / "s", []
    with Recorder(folder, ABOUT) as recorder:
        for i in range(BATCHES):
            recorder.append(block(i * ROWS, ROWS))
            recorder.flush()
            sizes.append((folder / "samples.arrows").stat().st_size)
            recorder.mark("window", position=0, start_s=0.0, end_s=0.001 * (i + 1))
    return folder, sizes


@pytest.fixture(scope="module")
def session(recording: tuple[Path, list[int]]) -> Path:
    return recording[0]


@pytest.fixture(scope="module")
def sizes(recording: tuple[Path, list[int]]) -> list[int]:
    return recording[1]


def is_start_of_what_was_recorded(found: Block) -> bool:
    return same(found, block(0, len(found)))


def test_samples_cut_at_any_byte_keep_every_whole_batch(
    session: Path, sizes: list[int], tmp_path: Path
) -> None:
    data = (session / "samples.arrows").read_bytes()
    assert sizes[-1] == len(data) - 8
    cut = tmp_path / "samples.arrows"
    cut.write_bytes(data)
    # a cut within the second or the third batch is one within the last
    for end in (*range(len(data), sizes[2] - 1, -1), *range(sizes[0], -1, -1)):
        os.truncate(cut, end)  # a file written anew waits for the disk each time
        whole = sum(end >= size for size in sizes)
        try:
            found, says, _ = sample_files.read_samples(cut)
        except SessionError as error:
            assert not whole and str(cut) in str(error)
            continue
        assert len(found) == ROWS * whole and is_start_of_what_was_recorded(found)
        assert bool(says) == (end < len(data))


def test_marks_cut_at_every_byte_keep_every_whole_line(
    session: Path, tmp_path: Path
) -> None:
    data = (session / "marks.jsonl").read_bytes()
    shutil.copytree(session, tmp_path / "s")
    for end in range(len(data) + 1):
        (tmp_path / "s" / "marks.jsonl").write_bytes(data[:end])
        opened = Session.open(tmp_path / "s")
        lines = data[:end].count(b"\n")
        there = len(list(opened.marks()))
        # the last line is whole without its end of line too
        assert there == lines or (there == lines + 1 and data[end : end + 1] == b"\n")
        half = data[:end].rpartition(b"\n")[2]
        assert bool(opened.warnings) == (bool(half) and there == lines)


def test_a_description_cut_at_every_byte_is_read_or_refused_in_words(
    session: Path, tmp_path: Path
) -> None:
    data = (session / "session.toml").read_bytes()
    shutil.copytree(session, tmp_path / "s")
    for end in range(len(data)):
        (tmp_path / "s" / "session.toml").write_bytes(data[:end])
        for finding in file_faults(tmp_path / "s"):
            assert finding.text


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_changed_bytes_cost_their_batch_and_invent_nothing(
    data: st.DataObject, session: Path
) -> None:
    whole = bytearray((session / "samples.arrows").read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(whole) - 1))
        whole[at] ^= data.draw(st.integers(1, 255))
    found = decode_stream(bytes(whole), sample_table.samples_schema())
    rows = [r for b in found.batches for r in b.column("seq").to_pylist()]
    assert set(rows) <= set(range(BATCHES * ROWS)) and len(set(rows)) == len(rows)
    for batch in found.batches:
        k = batch.column("seq").to_numpy()
        np.testing.assert_array_equal(batch.column("t").to_numpy(), k / 1000)
        np.testing.assert_array_equal(batch.column("az").to_numpy(), k * k)
    if len(rows) < BATCHES * ROWS:
        assert found.faults


@pytest.mark.parametrize("name", [b"crc32", b"number"])
def test_a_batch_whose_checksum_lost_its_name_is_damaged(
    name: bytes, session: Path
) -> None:
    whole = (session / "samples.arrows").read_bytes()
    found = decode_stream(
        whole.replace(name, b"x" + name[1:], 1), sample_table.samples_schema()
    )
    assert len(found.batches) == BATCHES - 1
    assert "rows 1 to 3 before 0.00 s are damaged" in found.faults[0]


def test_what_stands_behind_a_damaged_batch_is_read(
    session: Path, sizes: list[int], tmp_path: Path
) -> None:
    data = bytearray((session / "samples.arrows").read_bytes())
    path = tmp_path / "samples.arrows"
    data[sizes[1] - 3] ^= 1
    path.write_bytes(data)
    found, (says,), _ = sample_files.read_samples(path)
    np.testing.assert_array_equal(found.seq, [0, 1, 2, 6, 7, 8, 9, 10, 11])
    assert "rows 4 to 6 between 0.00 and 0.01 s are damaged" in says
    lost = data[: sizes[0]] + data[sizes[1] :]
    path.write_bytes(lost)
    found, (says,), _ = sample_files.read_samples(path)
    assert len(found) == 9 and "rows 4 to 6 between 0.00 and 0.01 s" in says
    path.write_bytes(data[: sizes[0]] + data[sizes[2] - 40 :])
    found, says_of_hole, _ = sample_files.read_samples(path)
    np.testing.assert_array_equal(found.seq, [0, 1, 2, 9, 10, 11])
    assert any("damaged" in text for text in says_of_hole)


def test_a_doubled_batch_counts_once(
    session: Path, sizes: list[int], tmp_path: Path
) -> None:
    data = (session / "samples.arrows").read_bytes()
    path = tmp_path / "samples.arrows"
    path.write_bytes(data[: sizes[1]] + data[sizes[0] :])
    found, (says,), _ = sample_files.read_samples(path)
    assert len(found) == BATCHES * ROWS and "twice" in says


@pytest.mark.parametrize("times", [2, pytest.param(20, marks=pytest.mark.thorough)])
def test_a_killed_recording_keeps_every_batch_it_had_written(
    tmp_path: Path, times: int
) -> None:
    for i, moment in enumerate(moments(times, seed=1)):
        written = killed(tmp_path / str(i), moment)
        assert not faults(tmp_path / str(i), written)


def test_a_full_disk_is_said_and_what_was_recorded_is_kept(tmp_path: Path) -> None:
    if not os.path.exists("/dev/full"):
        pytest.skip("this system has no /dev/full")
    recorder = Recorder(tmp_path / "s", ABOUT)
    recorder.append(block(0))
    recorder.flush()
    disk = os.dup(recorder._samples.fd)
    full = os.open("/dev/full", os.O_WRONLY)
    os.dup2(full, recorder._samples.fd)
    recorder.append(block(50))
    with pytest.raises(SessionError, match="the disk is full: make room"):
        recorder.flush()
    assert len(Session.open(tmp_path / "s").block) == 50
    os.dup2(disk, recorder._samples.fd)
    recorder.close()
    assert len(Session.open(tmp_path / "s").block) == 100
    assert not list(file_faults(tmp_path / "s"))
    os.close(disk)
    os.close(full)


LIMITED = """
import sys, resource, signal
from pathlib import Path
from fieldcal.core.errors import SessionError
from recorded import record
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
try:
    record(Path(sys.argv[1]))
except SessionError as error:
    print(error)
"""


@pytest.mark.parametrize("limit", [9_001, 50_000])
def test_a_disk_that_takes_half_a_batch_is_left_with_whole_ones(
    tmp_path: Path, limit: int
) -> None:
    command = [sys.executable, "-c", LIMITED, str(tmp_path / "s"), str(limit)]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[1],
    )
    *lines, said = done.stdout.strip().split("\n")
    assert "what was recorded is kept" in said, done.stderr
    assert not done.stderr
    assert not faults(tmp_path / "s", max(map(int, lines)))


@pytest.mark.parametrize("cut", [0, 8, 100])
def test_a_recording_that_broke_off_is_gone_on_with(tmp_path: Path, cut: int) -> None:
    folder = tmp_path / "s"
    with Recorder(folder, ABOUT) as recorder:
        for first in (0, 50):
            recorder.append(block(first))
            recorder.flush()
    path = folder / "samples.arrows"
    path.write_bytes(path.read_bytes()[: -cut or None])
    (folder / "marks.jsonl").write_text('{"event": "told", "text": "a"}\n{"eve')
    there = 100 if cut <= 8 else 50
    with Recorder(folder, None) as recorder:
        recorder.append(block(5000))
        recorder.append(block(5050))
        recorder.mark("told", text="b")
    found = Session.open(folder)
    expected = [*range(there), *range(5000, 5100)]
    np.testing.assert_array_equal(found.block.seq, expected)
    assert [m["text"] for m in found.marks()] == ["a", "b"]
    assert not found.warnings and not list(file_faults(folder))
    with Recorder(folder, None) as recorder:
        # its clock has begun anew, and goes on behind a break
        shifted = recorder.append(block(0))
    assert shifted.t[0] >= 5.099 + 1.0
    assert (np.diff(Session.open(folder).block.t) > 0).all()


def test_samples_of_a_device_that_falls_silent_are_written(tmp_path: Path) -> None:
    with Recorder(tmp_path / "s", ABOUT) as recorder:
        recorder.append(block(0))
        path = tmp_path / "s" / "samples.arrows"
        while not path.stat().st_size:
            time.sleep(0.01)
        assert len(Session.open(tmp_path / "s").block) == 50


def test_samples_wait_no_longer_than_a_fifth_of_a_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a kill may cost, by a clock that we hold."""
    now = 100.0
    monkeypatch.setattr("fieldcal.session.recorder.monotonic", lambda: now)
    with Recorder(tmp_path / "s", ABOUT) as recorder:
        path = tmp_path / "s" / "samples.arrows"
        recorder.append(block(0))
        now = 100.19
        recorder.append(block(50))
        assert not path.stat().st_size
        now = 100.21
        recorder.append(block(100))
        assert len(Session.open(tmp_path / "s").block) == 150


def test_two_recorders_cannot_begin_in_one_folder(tmp_path: Path) -> None:
    with Recorder(tmp_path / "s", ABOUT):
        before = (tmp_path / "s" / "session.toml").read_bytes()
        with pytest.raises(SessionError, match="records into it"):
            Recorder(tmp_path / "s", {"format": 1})
        assert (tmp_path / "s" / "session.toml").read_bytes() == before


def test_verify_says_each_thing_in_a_line(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "s"
    shutil.copytree(session, folder)
    assert main(["verify", str(folder)]) == 0
    assert capsys.readouterr().out == f"{folder}: whole\n"
    data = bytearray((folder / "samples.arrows").read_bytes())
    data[-100] ^= 1
    (folder / "samples.arrows").write_bytes(data)
    marks = (folder / "marks.jsonl").read_text()
    (folder / "marks.jsonl").write_text(marks.replace("0.002", "0.003"))
    with (folder / "session.toml").open("a") as toml:
        toml.write('\n[[position]]\nname = 3\nstart_s = 1.0\nend_s = "x"\n')
    (folder / "result.json").write_text('{"format": 1}')
    (folder / "diagnosis.json").write_text("{")
    (folder / ".result.json.abc").write_text("{")
    assert main(["verify", str(folder)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines[:3]] == [
        "session.toml", "samples.arrows", "marks.jsonl"
    ]  # fmt: skip
    assert "line 2 is damaged" in lines[2]
    assert any(line.startswith("result.json: the whole: 'method'") for line in lines)
    assert any(line.startswith("diagnosis.json: is not JSON") for line in lines)
    assert lines[-1].startswith(".result.json.abc: was left")
    assert main(["verify", str(tmp_path / "nowhere")]) == 2


@pytest.mark.thorough
def test_a_session_that_was_run_and_diagnosed_is_held_to_its_schemas(
    recalibrated: Recalibrated, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = recalibrated.copy(tmp_path / "s")
    main(["diagnose", str(folder)])
    capsys.readouterr()
    code = main(["verify", str(folder)])
    assert (code, capsys.readouterr().out) == (0, f"{folder}: whole\n")
    assert (folder / "result.json").exists() and (folder / "diagnosis.json").exists()
