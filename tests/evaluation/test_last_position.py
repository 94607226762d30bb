"""A last position that was set wrongly looks like a step of the bias before it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from session_folders import write_session

from fieldcal.cli import main
from fieldcal.core.samples import Block

PLACES = [(0, 0), (45, 5), (-45, 5), (-45, -5), (45, -5), (0, 5), (22.5, -5), (45, 5)]
RATE, SECONDS, PAUSE = 100.0, 30.0, 1.0
GYR_BIAS = np.array([0.01, 0.02, -0.01])


def force(alpha: float, beta: float) -> np.ndarray[Any, np.dtype[Any]]:
    """Specific force in the procedure's axes, (13) of the paper with G = 9.81."""
    a, b = np.deg2rad([alpha, beta])
    out: np.ndarray[Any, np.dtype[Any]] = 9.81 * np.array(
        [-np.sin(a), -np.cos(a) * np.cos(b), np.cos(a) * np.sin(b)]
    )
    return out


def last_off_by(off: float, folder: Path) -> Path:
    """A session of a perfect device, of which only the rests were recorded."""
    rng, n = np.random.default_rng(0), int(RATE * SECONDS)
    blocks, tables = [], []
    for i, (alpha, beta) in enumerate(PLACES):
        start = i * (SECONDS + PAUSE)
        t = start + np.arange(n) / RATE
        held = force(alpha + off * (i == len(PLACES) - 1), beta)
        acc = held + rng.normal(0.0, 0.005, (n, 3))
        blocks.append((t, acc, GYR_BIAS + rng.normal(0.0, 0.001, (n, 3))))
        span = {"start_s": start + 1.0, "end_s": start + SECONDS - 0.5}
        tables.append({"alpha_deg": alpha, "beta_deg": beta, **span})
    t, acc, gyr = (np.concatenate(some) for some in zip(*blocks, strict=True))
    site = {"latitude_deg": 50.0, "height_m": 0.0, "gravity": 9.81,
            "angle_setting_deg": 0.01}  # fmt: skip
    return write_session(folder, Block.of(t, acc, gyr), tables, site=site)


@pytest.mark.thorough
@pytest.mark.parametrize("off", [0.6, -0.6, 0.5, 1.0])
def test_no_number_is_wrong(
    off: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Either may be; if the ± covers both, there is no GO."""
    code = main(["solve", str(last_off_by(off, tmp_path / "s")), "--json"])
    said = json.loads(capsys.readouterr().out)
    assert code in (0, 1)
    for name, truth in (("acc_bias", 0.0), ("acc_scale", 1.0)):
        found = said["parameters"][name]
        far = np.abs(np.array(found["value"]) - truth)
        assert (far < 4 * np.array(found["sigma"])).all(), name
        assert (far < 0.02).all()
