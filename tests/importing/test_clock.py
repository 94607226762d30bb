"""Times of recordings: steps of the clock are no time, pauses are no sampling rate."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.cli import main
from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.session.stream_facts import StreamFacts
from fieldcal.session.clock_steps import ClockStepRemover
from fieldcal.session.folder import Session

FIX = 1.7e9
"""A time of day that a receiver might tell, s since 1970."""


def steadied(t: Array, cuts: list[int]) -> tuple[Array, ClockStepRemover]:
    """Times after the clock's steps, handed over in pieces."""
    block, clock = Block.of(t, np.ones((len(t), 3))), ClockStepRemover()
    edges = [0, *sorted(c for c in cuts if c < len(t)), len(t)]
    parts = [block[a:b] for a, b in zip(edges, edges[1:], strict=False)]
    return concat([*(clock.add(p) for p in parts), clock.flush()]).t, clock


@given(
    st.integers(2, 80),
    st.lists(st.integers(0, 80), max_size=6),
    st.sampled_from([FIX, -FIX, 3e8]),
)
def test_a_lasting_step_is_taken_out_however_the_rows_come(
    at: int, cuts: list[int], by: float
) -> None:
    smooth = FIX * (by < 0) + np.arange(80) / 64
    stepped = smooth + by * (np.arange(80) >= at)
    got, clock = steadied(stepped, cuts)
    np.testing.assert_allclose(got, smooth, atol=1e-6)
    assert [s.by_s for s in clock.steps] == (
        [] if at >= 80 else [pytest.approx(by + 1 / 64, abs=1e-5)]
    )


@given(
    st.integers(1, 76),
    st.integers(1, 3),
    st.lists(st.integers(0, 80), max_size=6),
    st.sampled_from([0.0, 4 * FIX]),
)
def test_a_wrong_time_is_no_step(
    at: int, many: int, cuts: list[int], wrong: float
) -> None:
    t = FIX + np.arange(80) / 64
    t[at : at + many] = wrong
    got, clock = steadied(t, cuts)
    np.testing.assert_array_equal(got, t)
    assert not clock.steps


def test_a_step_there_and_back_is_two() -> None:
    smooth = np.arange(300) / 100
    stepped = smooth + FIX * ((smooth >= 1) & (smooth < 2))
    got, clock = steadied(stepped, [150])
    np.testing.assert_allclose(got, smooth, atol=1e-6)
    assert len(clock.steps) == 2
    assert "UTC" in clock.steps[0].sentence()
    assert "UTC" not in clock.steps[1].sentence()


def resting(t: Array) -> Array:
    """Rows of a device at rest, turned over after each pause of a second or more."""
    rng = np.random.default_rng(3)
    side = np.cumsum(np.diff(t, prepend=t[0]) >= 1) % 3
    acc = 9.8 * np.eye(3)[side] + 0.02 * rng.standard_normal((len(t), 3))
    return np.column_stack([t, acc, 1e-3 * rng.standard_normal((len(t), 3))])


def imported(folder: Path, rows: Array, *more: str) -> Session:
    path = folder / "log.csv"
    np.savetxt(path, rows, delimiter=",", fmt="%.6f")
    out = folder / "out"
    call = ["import", str(path), "--columns", "t,ax,ay,az,gx,gy,gz", "-o", str(out)]
    assert main([*call, *more]) == 0
    return Session.open(out)


def test_a_session_has_the_step_as_a_mark_and_not_as_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    t = np.arange(1000) / 50
    session = imported(tmp_path, resting(t + FIX * (t >= 12)))
    assert session.block.t[-1] == pytest.approx(t[-1], abs=1e-4)
    (step,) = [m for m in session.marks() if m["event"] == "clock_step"]
    assert step["at_s"] == pytest.approx(12, abs=1e-4)
    assert step["by_s"] == pytest.approx(FIX + 0.02)
    assert "2023-11-14 22:13 UTC" in capsys.readouterr().err
    assert main(["verify", str(session.folder)]) == 0
    capsys.readouterr()
    assert main(["diagnose", str(session.folder), "--json"]) in (0, 1)
    json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("pause", [3.0, 300.0])
def test_a_pause_ends_a_stretch_and_is_no_rate(tmp_path: Path, pause: float) -> None:
    burst = np.arange(250) / 50
    t = np.concatenate([burst + k * (5 + pause) for k in range(12)])
    session = imported(tmp_path, resting(t))
    windows = [w for w in session.windows if w]
    assert len(windows) == 12
    for k, (start, end) in enumerate(windows):
        assert k * (5 + pause) <= start < end <= k * (5 + pause) + 5
        assert end - start > 3.5
    (mark,) = [m for m in session.marks() if m["event"] == "imported"]
    assert mark["rate_hz"] == pytest.approx(50, rel=1e-6)
    assert mark["gaps"] == 11
    assert mark["paused_s"] == pytest.approx(11 * (pause + 0.02), rel=1e-6)


@given(st.lists(st.integers(8, 60), min_size=2, max_size=12))
def test_the_rate_is_that_of_the_bursts(sizes: list[int]) -> None:
    facts, start = StreamFacts(), 0.0
    bursts = []
    for size in sizes:
        bursts.append(start + np.arange(size) / 32)
        start = bursts[-1][-1] + 128
    t = np.concatenate(bursts)
    facts.add(Block.of(t, np.ones((len(t), 3))))
    assert facts.rate_hz == pytest.approx(32)
    assert facts.gaps == len(sizes) - 1
