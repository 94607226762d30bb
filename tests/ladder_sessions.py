"""Sessions of the second virtual device, diagnosed, and what is asked of the answer."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import ladder
import pytest
from ladder import (
    HEIGHT_M,
    LADDER,
    LATITUDE_DEG,
    NAVIGATION,
    Device,
    Fault,
    record,
    ride,
    windows,
)
from session_folders import write_session

from fieldcal.diagnosis import diagnose
from fieldcal.diagnosis.result import Diagnosis
from fieldcal.session.folder import Session


def hold_first(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hold so many positions of the ladder only."""
    for module in (ladder, sys.modules[__name__]):
        monkeypatch.setattr(module, "LADDER", LADDER[:count])


def tables(device: Device) -> dict[str, Any]:
    """What session.toml says of the ladder with a device on it."""
    grade = "navigation" if device is NAVIGATION else "tactical"
    return {
        "site": {"latitude_deg": LATITUDE_DEG, "height_m": HEIGHT_M},
        "device": {"name": "second", "grade": grade},
        "nominal": {
            "acc_bias": [b + 0.01 for b in device.acc_bias],
            "acc_scale": list(device.acc_scale),
            "gyr_bias": list(device.gyr_bias),
            "gyr_scale": [1.0, 1.0, 1.0],
        },
        "position": [
            {"alpha_deg": float(a), "beta_deg": float(b), "start_s": s, "end_s": e}
            for (a, b), (s, e) in zip(LADDER, windows(), strict=True)
        ],
    }


def diagnosed(
    folder: Path, device: Device, *faults: Fault, seed: int = 1, setting: float = 0.0
) -> Diagnosis:
    """Ride, record, write and read the session, and diagnose it."""
    said = tables(device)
    block = record(device, ride(device, seed, setting), faults)
    write_session(folder, block, said.pop("position"), **said)
    session = Session.open(folder)
    return diagnose(session.block, session.about)


def named(said: Diagnosis) -> list[str]:
    return [effect.id for effect in said.effects]


def agrees(said: Diagnosis, name: str, truth: dict[str, float]) -> None:
    """Every parameter within 3.5 of its standard uncertainties."""
    (effect,) = [e for e in said.effects if e.id == name]
    for parameter, value in truth.items():
        found = effect.parameters[parameter]
        assert isinstance(found.value, float) and found.sigma
        assert abs(found.value - value) < 3.5 * found.sigma, (parameter, found)
