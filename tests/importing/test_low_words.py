"""Counts of 32 bits, whose halves have columns of their own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import G, turned, write

from fieldcal.core.samples import Array
from fieldcal.importing.read_options import ReadOptions

ROWS = turned(59, 50.0, 2.0)
SIX = np.column_stack([np.rad2deg(ROWS[:, 4:]) * 10, ROWS[:, 1:4] / G * 800])
NAMES = [f"{x}{sensor}" for sensor in ("GYRO", "ACCL") for x in "XYZ"]


def halves(signed: bool) -> tuple[Array, Array]:
    """Upper and lower 16 bits (n, 6) of counts of 32."""
    counts = np.round(SIX * 65536)
    low = np.mod(counts, 65536)
    high = (counts - low) / 65536
    return high, np.where(low >= 32768, low - 65536, low) if signed else low


@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize("said", [False, True])
def test_both_halves_make_a_number(said: bool, signed: bool, tmp_path: Path) -> None:
    high, low = halves(signed)
    table = np.stack([low, high], axis=2).reshape(len(ROWS), -1)
    heading = ",".join(f"{name}_{half}" for name in NAMES for half in ("LOW", "OUT"))
    path = write(tmp_path, table, heading=heading)
    channels = ("gx", "gy", "gz", "ax", "ay", "az")
    named = tuple(name for c in channels for name in (f"low_{c}", c))
    wanted = ReadOptions(columns=named if said else (), rate_hz=50.0)
    block, _ = read_files([path], wanted)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-7)


def test_low_alone_is_a_name_like_others(tmp_path: Path) -> None:
    heading = "t," + ",".join(f"low_g_acc_{x}" for x in "xyz") + ",gx,gy,gz"
    block, _ = read_files([write(tmp_path, ROWS, heading=heading)])
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)
