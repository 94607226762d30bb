"""The same samples are recognised, whatever folder, file or facts they come with."""

from __future__ import annotations

import csv
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import write_session

from fieldcal.core.documents import load_toml
from fieldcal.core.recorded_part import RecordedPart
from fieldcal.core.samples import Block
from fieldcal.session import sample_files
from fieldcal.session.folder import Session
from fieldcal.session.recorded_part import recorded_part
from fieldcal.session.recorder import Recorder

RNG = np.random.default_rng(1)
BLOCK = Block.of(np.arange(200) / 10, RNG.normal(size=(200, 3)),
                 RNG.normal(size=(200, 3)))  # fmt: skip
HELD = [{"start_s": 2.0, "end_s": 5.0}, {"start_s": 8.0, "end_s": 12.0}]


def part(folder: Path) -> RecordedPart:
    found = recorded_part(folder)
    assert found is not None
    return found


def test_a_copy_with_other_facts_is_the_same_recording(tmp_path: Path) -> None:
    first = part(write_session(tmp_path / "a", BLOCK, HELD))
    other = [{**HELD[0], "alpha_deg": 45.0, "beta_deg": 0.0}, HELD[1]]
    device = {"serial": "B2"}
    assert part(write_session(tmp_path / "b", BLOCK, other, device=device)) == first
    assert (first.start, first.end) == (2.0, 12.0)
    more = replace(BLOCK, temperature=np.full(200, 20.0), t_host=BLOCK.t + 1e9)
    assert part(write_session(tmp_path / "c", more, HELD)) == first


def test_other_samples_are_another_recording(tmp_path: Path) -> None:
    first = part(write_session(tmp_path / "a", BLOCK, HELD))
    for i, change in enumerate(("t", "acc", "gyr")):
        values = getattr(BLOCK, change).copy()
        values[-1] += 1e-9
        other = replace(BLOCK, **{change: values})
        found = part(write_session(tmp_path / str(i), other, HELD))
        assert found.digest != first.digest, change
        assert not found.overlaps(first)


def test_two_parts_of_a_recording_are_two(tmp_path: Path) -> None:
    whole = part(write_session(tmp_path / "a", BLOCK, []))
    assert whole.start == 0.0 and whole.end == pytest.approx(19.9)
    one, two = (part(write_session(tmp_path / f"b{i}", BLOCK, HELD[i : i + 1]))
                for i in (0, 1))  # fmt: skip
    assert not one.overlaps(two)
    assert one.overlaps(whole) and whole.overlaps(two)


def test_neither_format_nor_size_of_parts_matters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lost = BLOCK.acc.copy()
    lost[3, 1], lost[4, 2] = np.nan, -0.0
    block = replace(BLOCK, acc=lost)
    first = part(write_session(tmp_path / "a", block, HELD))
    monkeypatch.setattr(sample_files, "ROWS_AT_ONCE", 7)
    assert part(tmp_path / "a") == first
    (tmp_path / "b").mkdir()
    shutil.copy(tmp_path / "a" / "session.toml", tmp_path / "b")
    with (tmp_path / "b" / "samples.csv").open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["t", "ax", "ay", "az", "gx", "gy", "gz"])
        for t, six in zip(block.t.tolist(), block.six.tolist(), strict=True):
            out.writerow(["" if v != v else repr(v) for v in (t, *six)])
    assert part(tmp_path / "b") == first


def test_a_run_that_was_continued_is_the_run_of_its_copy(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a", {"format": 1}) as recorder:
        recorder.append(BLOCK[:120])
    shutil.copytree(tmp_path / "a", tmp_path / "copy")
    with Recorder(tmp_path / "a", None) as recorder:
        recorder.append(BLOCK[120:])
    continued, copy = part(tmp_path / "a"), part(tmp_path / "copy")
    assert (continued.samples, copy.samples) == (200, 120)
    assert continued.digest != copy.digest and continued.run == copy.run
    assert continued.overlaps(copy)


def test_each_run_has_an_id_of_its_own_whatever_its_plan_had(tmp_path: Path) -> None:
    plan: dict[str, object] = {"format": 1}
    for name in "ab":
        with Recorder(tmp_path / name, plan) as recorder:
            recorder.append(BLOCK if name == "a" else BLOCK[:120])
        plan = load_toml((tmp_path / name / "session.toml").read_text())
    first, second = (Session.open(tmp_path / name).about.recording_id for name in "ab")
    assert first and second and first != second
    assert not part(tmp_path / "a").overlaps(part(tmp_path / "b"))


def test_a_session_toml_that_was_copied_makes_no_copy_of_other_samples(
    tmp_path: Path,
) -> None:
    about = {"recording": {"id": "7f"}}
    first = part(write_session(tmp_path / "a", BLOCK, [], **about))
    other = part(write_session(tmp_path / "b", BLOCK[1:], [], **about))
    assert first.run and not first.overlaps(other)


def test_a_folder_without_samples_is_of_no_recording(tmp_path: Path) -> None:
    assert recorded_part(tmp_path) is None
    (tmp_path / "session.toml").write_text("format = 1\n")
    assert recorded_part(tmp_path) is None
