"""Sessions recorded while the device's clock was set, and pauses of days."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from laid_about import turned

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.exporters.kalibr import window_noise_density
from fieldcal.importing.session.sample_writer import SampleWriter
from fieldcal.session.clock_steps import ClockStepRemover, remove_clock_steps
from fieldcal.session.folder import Session

JUMP = 1.7e9
RATE = 50.0


def recorded(folder: Path, jump: float, windows: int = 7) -> np.ndarray:
    """A session as another program wrote it, its clock set in the middle."""
    rows = turned(3, RATE, 3.0, sides=7)
    n, t = len(rows), rows[:, 0]
    later = np.where(np.arange(n) < n // 2, 0.0, jump)
    with SampleWriter(folder / "samples.parquet") as file:
        file.add(Block.of(t + later, rows[:, 1:4], rows[:, 4:], np.full(n, 25.0)))
        file.close()
    text = "format = 1\n"
    for k in range(7 - windows, 7):
        start = 4.5 * k + 0.3
        a, b = (x + (jump if x >= t[n // 2] else 0.0) for x in (start, start + 2.4))
        text += f"[[position]]\nstart_s = {a!r}\nend_s = {b!r}\n"
    (folder / "session.toml").write_text(text)
    return rows


def test_times_and_windows_go_on(tmp_path: Path) -> None:
    rows = recorded(tmp_path, JUMP)
    session = Session.open(tmp_path)
    np.testing.assert_allclose(session.block.t, rows[:, 0], atol=1e-6)
    truth = np.array([(4.5 * k + 0.3, 4.5 * k + 2.7) for k in range(7)])
    np.testing.assert_allclose(np.array(session.windows), truth, atol=1e-6)
    assert "to 2023-11-14" in session.warnings[-1]


def test_noise_densities_are_those_of_windows_behind_the_step_too(
    tmp_path: Path,
) -> None:
    for name, jump in (("set", JUMP), ("even", 0.0)):
        (tmp_path / name).mkdir()
        recorded(tmp_path / name, jump, windows=3)
    found, plain = (
        window_noise_density(Session.open(tmp_path / name))[0]
        for name in ("set", "even")
    )
    assert np.isfinite(plain).all()
    # times of 1.7e9 s are rounded: a window may begin a sample later
    np.testing.assert_allclose(found, plain, rtol=0.1)


@pytest.mark.parametrize(
    ("jump", "windows"),
    [pytest.param(86400.0, 4, marks=pytest.mark.thorough), (JUMP, 0)],
)
def test_memory_is_that_of_the_rows_whatever_the_clock_says(
    tmp_path: Path, jump: float, windows: int, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded(tmp_path, jump, windows)
    tracemalloc.start()
    for command in ["diagnose", "report"] if windows else ["report"]:
        assert main([command, str(tmp_path)]) in (0, 1)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    capsys.readouterr()
    assert most < 200e6


def test_times_in_nanoseconds_are_no_clock_that_was_set() -> None:
    """Windows in seconds hold none of them: said with the times as they are."""
    t = 1e9 * np.arange(200) / 100
    block = Block.of(t, np.zeros((200, 3)), np.zeros((200, 3)))
    assert remove_clock_steps(block) is None
    clock = ClockStepRemover()
    parts = [clock.add(block[:100]), clock.add(block[100:]), clock.flush()]
    np.testing.assert_array_equal(np.concatenate([p.t for p in parts]), t)
    assert not clock.steps
