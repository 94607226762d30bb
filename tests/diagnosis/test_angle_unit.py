"""Angles that are written in radians where degrees are asked for."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from session_folders import SITE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.effects.mounting import angle_unit
from fieldcal.physics.experience import Experience
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.vocabulary import parse

FACES = [(0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90)]
FIVE = [(0, 0), (22.5, 0), (22.5, 2.5), (45, 2.5), (45, 5)]
TWO = [(0, 0), (45, 5)]
G = 9.81


def outputs(
    angles: list[tuple[float, float]], seed: int, scale: float = 3e-3
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Forces in positions, by (1) and (2), with a bias, a scale and a wrong setting."""
    rng = np.random.default_rng(seed)
    a, b = np.deg2rad(np.array(angles, float) + rng.normal(0, 0.5, (len(angles), 2))).T
    force = -G * np.column_stack([
        np.sin(a), np.cos(a) * np.cos(b), -np.cos(a) * np.sin(b)
    ])  # fmt: skip
    return force * (1 + rng.normal(0, scale, 3)) + rng.normal(0, 0.1, 3)


def stated(angles: list[tuple[float, float]], unit: float) -> Experience:
    alpha, beta = (unit * np.array(c, float) for c in zip(*angles, strict=True))
    return Experience.at_rest(alpha, beta, G)


@pytest.mark.parametrize("angles", [FACES, FIVE, TWO], ids=["faces", "five", "two"])
@pytest.mark.parametrize("seed", range(10))
def test_radians_are_told_from_degrees(
    angles: list[tuple[float, float]], seed: int
) -> None:
    held, seen = np.arange(len(angles)), outputs(angles, seed)
    degrees = np.deg2rad(1.0)
    assert angle_unit(stated(angles, degrees), held, seen) == ""
    assert angle_unit(stated(angles, degrees**2), held, seen) == "rad"
    # a gauge that is stretched is no other unit, nor are positions in another order
    assert angle_unit(stated(angles, 0.9 * degrees), held, seen) == ""
    order = np.random.default_rng(seed).permutation(len(angles))
    other = [angles[i] for i in order]
    assert angle_unit(stated(other, degrees), held, seen) == ""


@pytest.mark.thorough
def test_it_is_named_and_no_go(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device = Profile().having(parse("base_tilt:about_z_deg=0.8"))
    block = recorded(device, places(FACES))
    said = places([(np.deg2rad(a), np.deg2rad(b)) for a, b in FACES])
    site = {**SITE, "angle_setting_deg": 0.01}
    run = {"procedure": "positions"}
    write_session(tmp_path / "s", block, said, site=site, run=run)
    assert main(["solve", str(tmp_path / "s"), "--json"]) == 1
    result = json.loads(capsys.readouterr().out)
    assert not result["decision"]["go"]
    assert "the mounting (angles = rad)" in result["warnings"][0]
    assert main(["diagnose", str(tmp_path / "s"), "--json"]) == 1
    found = {e["id"]: e for e in json.loads(capsys.readouterr().out)["effects"]}
    assert found["mounting"]["parameters"]["angles"]["value"] == "rad"
    # and the rest of the recording is seen with angles as they were
    tilt = found["base_tilt"]["parameters"]["about_z_deg"]
    assert abs(tilt["value"] - 0.8) < 4 * tilt["sigma"] < 0.2
