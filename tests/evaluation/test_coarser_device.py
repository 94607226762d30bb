"""A device that is worse than it is called: what is not estimated of it follows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from session_folders import SITE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.sim_device.profile import Climate, NoiseFigures, Profile, Truth
from fieldcal.sim_device.vocabulary import checked_effect

LADDER = [(0.0, 0.0), (22.5, 0.0), (22.5, 2.5), (45.0, 2.5), (45.0, 5.0)]
LAID = [(178.0, 1.0), (91.5, -0.5), (-2.0, 88.0)]
"""Faces up and down as a hand lays them, whose angles nobody writes down."""

LOW_COST = Profile(
    noise=NoiseFigures(
        (0.005,) * 3,
        (5e-4,) * 3,
        acc_instability=(0.0,) * 3,
        gyr_instability=(0.0,) * 3,
    ),
    temperature=Climate(self_heating_k=0.0),
    effects=(
        checked_effect("earth_rate", {}),
        checked_effect(
            "cross_coupling", {"k12": 0.012, "k13": -0.008, "k21": -0.015, "k32": 0.01}
        ),
        checked_effect("g_sensitivity", {"g12": 8e-5, "g33": -6e-5}),
        checked_effect("gyro_cross_coupling", {"s12": 0.01, "s31": -0.012}),
    ),
    truth=Truth((0.1, -0.2, 0.55), (1.012, 0.99, 1.02), (0.03, -0.02, 0.01)),
)
"""As data sheets of low-cost devices have it: axes square to 2 %, biases of 80 mg."""


def solved(
    profile: Profile, folder: Path, capsys: pytest.CaptureFixture[str], grade: str
) -> dict[str, Any]:
    """result.json of five positions and three faces."""
    held = places([*LADDER, *LAID])
    samples = recorded(profile, held)
    said = [
        {k: v for k, v in p.items() if i < len(LADDER) or k in ("start_s", "end_s")}
        for i, p in enumerate(held)
    ]
    write_session(
        folder,
        samples,
        said,
        device={"grade": grade},
        site={**SITE, "angle_setting_deg": 0.003},
        run={"procedure": "positions"},
    )
    main(["solve", str(folder), "--json", "--history", str(folder / "history.sqlite")])
    out: dict[str, Any] = json.loads(capsys.readouterr().out)
    return out


def pulls(said: dict[str, Any], profile: Profile) -> np.ndarray[Any, np.dtype[Any]]:
    """How far biases and scale factors are off, in stated sigmas."""
    return np.concatenate(
        [
            (np.array(said["parameters"][n]["value"]) - getattr(profile.truth, n))
            / np.array(said["parameters"][n]["sigma"])
            for n in ("acc_bias", "acc_scale", "gyr_bias")
        ]
    )


@pytest.mark.thorough
def test_a_low_cost_device_is_one_whatever_it_is_called(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = solved(LOW_COST, tmp_path / "s", capsys, "tactical")
    assert np.abs(pulls(said, LOW_COST)).max() < 4
    assert said["square_sigma"] == 1e-2
    checks = {c["name"]: c for c in said["decision"]["checks"]}
    assert "--grade consumer" in checks["grade"]["says"]
    assert "acc_bias.z is +0.55 m/s² from nominal" in checks["grade"]["says"]
    assert "± 1 %, as usual for consumer grade" in checks["cross-coupling"]["says"]
