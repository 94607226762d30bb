"""Times whose fraction was written as a number of its own, without leading zeros."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import turned

from fieldcal.importing.text.bare_fractions import BareFractions

ROWS = turned(4, 25.0, 1.0)
BEGAN_MS = 58_640
NAMES = "time,ax (m/s^2),ay (m/s^2),az (m/s^2),gx (rad/s),gy (rad/s),gz (rad/s)"


def clock(ms: int) -> str:
    s = ms // 1000
    return f"{12 + s // 3600}:{s // 60 % 60:02d}:{s % 60:02d}.{ms % 1000}"


def dated(ms: int) -> str:
    return f"2024-05-03T{clock(ms)}Z"


def colons(ms: int) -> str:
    return clock(ms).replace(".", ":")


def seconds(ms: int) -> str:
    return f"{ms // 1000}.{ms % 1000}"


def micro(ms: int) -> str:
    return f"{ms // 1000}.{ms % 1000 * 1000 + 7}"


def lines(stamp: Callable[[int], str]) -> list[str]:
    found = [NAMES]
    for t, *six in ROWS.tolist():
        cells = ",".join(f"{x:.9f}" for x in six)
        found.append(f"{stamp(BEGAN_MS + round(1000 * t))},{cells}")
    return found


@pytest.mark.parametrize("stamp", [clock, dated, colons, seconds, micro])
def test_a_fraction_without_its_zeros_is_filled(
    tmp_path: Path, stamp: Callable[[int], str]
) -> None:
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*lines(stamp), ""]))
    block, says = read_files([path])
    np.testing.assert_allclose(block.t - block.t[0], ROWS[:, 0], atol=2e-6)
    (said,) = [one for one in says if "leading zeros" in one]
    assert f"{stamp(59_000)} is taken as" in said


def trimmed(ms: int) -> str:
    return f"{ms / 1000:.3f}".rstrip("0").rstrip(".")


def whole(ms: int) -> str:
    return f"{ms / 1000:.3f}"


@pytest.mark.parametrize("stamp", [trimmed, whole])
def test_decimals_stay_as_they_are(stamp: Callable[[int], str]) -> None:
    assert BareFractions.of(lines(stamp), None) is None


def test_times_that_step_back_in_both_readings_stay_as_they_are() -> None:
    text = lines(clock)
    text[20:40] = reversed(text[20:40])
    assert BareFractions.of(text, None) is None
