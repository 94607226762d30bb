"""Time codes of video, and times whose parts of a second only look so."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned

from fieldcal.core.samples import Array

BEGAN = datetime(2026, 3, 14, 23, 59, 50)


def log(rows: Array, time: Callable[[float], str], sign: str = ",") -> str:
    head = sign.join("time ax ay az gx gy gz".split())
    lines = [sign.join([time(t), *(f"{x:.8g}" for x in row)])
             for t, *row in rows.tolist()]  # fmt: skip
    return "\n".join([head, *lines]) + "\n"


def clock(t: float) -> str:
    return (BEGAN + timedelta(seconds=int(t + 1e-6))).strftime("%H:%M:%S")


@pytest.mark.parametrize("mark", [":", ";"])
@pytest.mark.parametrize("frames", [24, 25, 30, 50, 60])
def test_frames_are_parts_of_a_second(frames: int, mark: str, tmp_path: Path) -> None:
    rows = turned(55, float(frames), 2.0)
    path = tmp_path / "log.csv"
    text = log(rows, lambda t: f"{clock(t)}{mark}{round(t * frames) % frames:02d}")
    path.write_text(text)
    block, says = read_files([path])
    np.testing.assert_allclose(block.t, rows[:, 0], atol=1e-6)
    np.testing.assert_allclose(block.acc, rows[:, 1:4], atol=1e-6)
    assert any(f"time codes of {frames} frames" in said for said in says)


def test_every_third_frame_tells_the_rate(tmp_path: Path) -> None:
    rows = turned(55, 30.0, 2.0)[::3]
    path = tmp_path / "log.csv"
    path.write_text(log(rows, lambda t: f"{clock(t)}:{round(t * 30) % 30:02d}"))
    block, _ = read_files([path])
    np.testing.assert_allclose(block.t, rows[:, 0], atol=1e-6)


@pytest.mark.parametrize(("mark", "parts"), [(":", 100), (".", 100), (":", 1000)])
@pytest.mark.parametrize("rate", [2.0, 5.0, 50.0])
def test_decimals_are_no_frames(
    rate: float, mark: str, parts: int, tmp_path: Path
) -> None:
    rows = turned(55, rate, 6.0)
    digits = len(str(parts)) - 1
    path = tmp_path / "log.csv"
    path.write_text(log(
        rows, lambda t: f"{clock(t)}{mark}{round(t * parts) % parts:0{digits}d}"
    ))  # fmt: skip
    block, says = read_files([path])
    np.testing.assert_allclose(block.t, rows[:, 0], atol=1e-6)
    assert not any("time codes" in said for said in says)


def test_a_semicolon_that_parts_columns_is_none_before_frames(tmp_path: Path) -> None:
    rows = turned(55, 10.0, 2.0)
    counted = [f"{clock(t)};{i % 10:02d};{t:.1f}" for i, t in enumerate(rows[:, 0])]
    text = log(rows, lambda t: counted[round(t * 10)], ";")
    path = tmp_path / "log.csv"
    path.write_text(text.replace("time;", "clock;count;t [s];", 1))
    block, says = read_files([path])
    np.testing.assert_allclose(block.acc, rows[:, 1:4], atol=1e-6)
    assert not any("time codes" in said for said in says)
