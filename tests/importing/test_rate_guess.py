"""Units of rates that nobody says, by turns of gravity or without them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from joined import read_files
from laid_about import COLUMNS, GYR, G, turned, write

from fieldcal.cli import main
from fieldcal.session.folder import Session


@pytest.mark.parametrize(
    ("rate", "code", "why"),
    [((0.01, 0, 0), 0, "rad/s: it is the usual one, and no turn tells"),
     # of rates about the force a turntable may be the reason, of others only a bias
     ((0, 0, 3.0), 2, "is no rest: add --gyr-unit deg/s or --gyr-unit rad/s"),
     ((3.0, 0, 0), 2, "is no rest: add --gyr-unit deg/s")],
)  # fmt: skip
def test_rates_of_which_no_turn_tells_are_said_or_asked(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    rate: tuple[float, float, float],
    code: int,
    why: str,
) -> None:
    rng = np.random.default_rng(4)
    n = 1000
    acc = [0, 0, G] + rng.normal(0, 0.02, (n, 3))
    gyr = rate + rng.normal(0, 0.002, (n, 3))
    path = write(tmp_path, np.column_stack([np.arange(n) / 50, acc, gyr]))
    out = tmp_path / "out"
    assert main(["import", str(path), "--columns", COLUMNS, "-o", str(out)]) == code
    assert why in capsys.readouterr().err


@pytest.mark.parametrize("unit", ["rad/s", "deg/s"])
def test_clipped_rates_tell_their_unit_by_what_is_not(
    tmp_path: Path, unit: str
) -> None:
    rows = turned(9, 50.0)
    rows[:, 4:] = np.clip(rows[:, 4:], -1.5, 1.5)
    log = np.column_stack([rows[:, :4], rows[:, 4:] * GYR[unit]])
    path, out = write(tmp_path, log), tmp_path / "out"
    assert main(["import", str(path), "--columns", COLUMNS, "-o", str(out)]) == 0
    np.testing.assert_allclose(Session.open(out).block.gyr, rows[:, 4:], atol=1e-6)


@pytest.mark.parametrize("per_rad", [1.0, 180 / np.pi])
@pytest.mark.parametrize("rate", [50.0, 200.0])
def test_angles_gained_beside_forces_are_told_by_the_turns(
    tmp_path: Path, per_rad: float, rate: float
) -> None:
    """As a fibre-optic device writes them: force in g, rad since the row before."""
    rows = turned(9, rate)
    log = np.column_stack([rows[:, 0], rows[:, 1:4] / G, rows[:, 4:] * per_rad / rate])
    block, _ = read_files([write(tmp_path, log)])
    np.testing.assert_allclose(block.six, rows[:, 1:], atol=1e-6)


@pytest.mark.parametrize("lsb", [14.375, 1 / 0.07])
def test_counts_that_two_gyroscopes_have_are_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], lsb: float
) -> None:
    """Beside an ADXL345 stands an ITG-3200, or one by ST 0.6 % off it."""
    table = turned(7, 100.0)
    table[:, 1:4] = np.round(table[:, 1:4] / G * 256)
    table[:, 4:] = np.round(np.rad2deg(table[:, 4:]) * lsb)
    path = write(tmp_path, table, heading=COLUMNS)
    assert main(["import", str(path)]) == 2
    asked = capsys.readouterr().err
    assert "--gyr-lsb 14.375" in asked
    assert "--gyr-lsb 14.2857" in asked
