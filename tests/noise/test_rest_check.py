"""A device that turns all the time is not at rest, though nothing disturbs it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fieldcal.cli import main
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block
from fieldcal.session.recorder import Recorder

HZ, SECONDS = 20.0, 120.0
T = np.arange(HZ * SECONDS) / HZ


def session(folder: Path, angle: Array, rate: Array) -> Path:
    """A device whose x axis leans by angles (n,), with rates (n, 3), rad/s."""
    rng = np.random.default_rng(5)
    acc = G0 * np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    acc += 0.1 * rng.standard_normal(acc.shape)
    gyr = rate + 1e-3 * rng.standard_normal(acc.shape)
    with Recorder(folder, {"format": 1, "device": {"name": "bench"}}) as recorder:
        recorder.append(Block.of(T, acc, gyr))
    return folder


@pytest.mark.parametrize(
    ("deg_per_s", "spin_deg_s", "expected"),
    [
        (0.3, 0.0, "leans by 36°"),
        (0.0, 40.0, "reads 40 deg/s, which no bias is,"),
    ],
)
def test_one_that_turns_is_refused(
    deg_per_s: float,
    spin_deg_s: float,
    expected: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    about = np.deg2rad([0.0, deg_per_s, spin_deg_s])
    there = session(tmp_path / "s", T * about[1], np.tile(about, (len(T), 1)))
    assert main(["noise", str(there)]) == 2
    said = capsys.readouterr().err
    assert f"{there}: the device {expected} in 120 s that count as rest" in said
    assert not (there / "noise.json").exists()


def test_one_that_settles_or_has_a_bias_is_not(tmp_path: Path) -> None:
    bias = np.deg2rad([3.0, -8.0, 20.0])
    there = session(
        tmp_path / "s", np.deg2rad(5 * T / SECONDS), np.tile(bias, (len(T), 1))
    )
    assert main(["noise", str(there)]) == 0
