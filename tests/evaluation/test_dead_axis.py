"""A log of which one axis, or a whole sensor, says nothing; from import to verdict."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laid_about import turned, write

from fieldcal.cli import main
from fieldcal.core.samples import CHANNELS

HEADING = ",".join(("t", *CHANNELS))
OTHERS = {"a": "gyr_bias", "g": "acc_bias"}


def answers(tmp_path: Path, silent: list[int], code: int = 0) -> tuple[Any, Any]:
    """What solve and diagnose say of a log with zeros in some channels.

    `code` is what solve is to end with.
    """
    rows = turned(1, 25.0, hold=6.0, sides=7)
    rows[:, 1 + np.array(silent)] = 0.0
    log, folder = write(tmp_path, rows, heading=HEADING), tmp_path / "s"
    assert main(["import", str(log), "--gyr-unit", "rad/s", "-o", str(folder)]) == 0
    assert main(["solve", str(folder)]) == code
    assert main(["diagnose", str(folder)]) in (0, 1)
    return tuple(
        json.loads((folder / f"{name}.json").read_text())
        for name in ("result", "diagnosis")
    )


@pytest.mark.parametrize("channel", [2, pytest.param(4, marks=pytest.mark.thorough)])
def test_an_axis_that_never_changes_is_stuck_and_its_sensor_is_not_used(
    tmp_path: Path, channel: int
) -> None:
    name = CHANNELS[channel]
    solved, told = answers(tmp_path, [channel], code=1)
    assert solved["verdict"] == "bad"
    broken = f"{name} never changes while the rest of the sensor does"
    assert any(broken in w for w in solved["warnings"])
    assert list(solved["parameters"])[0] == OTHERS[name[0]]
    said = f"are not used: {name} never changes, or is missing"
    assert any(said in w for w in solved["warnings"])
    assert any(said in w for w in told["warnings"])
    (stuck,) = told["effects"]
    assert (stuck["id"], told["verdict"]) == ("stuck", "left_out")


def test_gyroscopes_that_are_not_there_are_not_stuck(tmp_path: Path) -> None:
    solved, told = answers(tmp_path, [3, 4, 5])
    assert "gyr_bias" not in solved["parameters"]
    assert (told["effects"], told["verdict"]) == ([], "consistent")
    assert any("gx, gy and gz never change" in w for w in told["warnings"])


def test_a_device_that_stands_has_the_biases_of_its_gyroscopes(tmp_path: Path) -> None:
    rows = turned(2, 50.0)
    still = np.tile(rows[5], (1000, 1))
    still[:, 0] = np.arange(1000) / 50.0
    rng = np.random.default_rng(3)
    still[:, 1:] += rng.normal(size=(1000, 6)) * np.repeat([0.02, 0.002], 3)
    log, folder = write(tmp_path, still, heading=HEADING), tmp_path / "s"
    assert main(["import", str(log), "--gyr-unit", "rad/s", "-o", str(folder)]) == 0
    assert main(["solve", str(folder)]) == 0
    solved = json.loads((folder / "result.json").read_text())
    assert list(solved["parameters"]) == ["gyr_bias"]
    found = solved["parameters"]["gyr_bias"]
    pulls = (np.array(found["value"]) - rows[5, 4:]) / np.array(found["sigma"])
    assert np.abs(pulls).max() < 4
    assert any("acc_bias.x" in w and "not determined" in w for w in solved["warnings"])
