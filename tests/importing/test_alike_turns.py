"""Runs of single axes side by side are told from one device."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laid_about import write

from fieldcal.cli import main
from fieldcal.core.samples import Array

SPEED = np.deg2rad(np.repeat([0.0, 50.0, 0.0, -50.0, 0.0, 100.0], 300))


def rates(axis: Array) -> Array:
    """Rows t, gx, gy, gz of a device that a table turns about an axis (3,)."""
    noise = np.random.default_rng(7).normal(0, 0.002, (len(SPEED), 3))
    t = np.arange(len(SPEED)) / 100
    return np.column_stack([t, np.outer(SPEED, axis) + [0.01, -0.02, 0.005] + noise])


@pytest.mark.parametrize(
    ("axis", "alike"),
    [((1.01, 0.99, 1.0), True), ((1.01, -0.99, 1.0), True), ((0.0, 0.0, 1.0), False),
     ((0.02, 0.03, -1.0), False), ((0.5, 0.6, 0.62), False)],
)  # fmt: skip
def test_axes_that_all_turn_alike_are_told(
    tmp_path: Path,
    axis: tuple[float, ...],
    alike: bool,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = write(tmp_path, rates(np.array(axis)), heading="t,gx,gy,gz")
    call = ["import", str(path), "-o", str(tmp_path / "s"), "--gyr-unit", "rad/s"]
    assert main(call) == 0
    said = capsys.readouterr().err
    told = "import them one by one, such as --columns t,gx,_,_" in said
    assert told is alike
