"""A stated level that the positions contradict is no GO; by itself it fits well."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from observed import observe, outputs
from session_folders import NINE, SITE, places, recorded, write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.positions import Position
from fieldcal.evaluation.level_check import with_tilt_shown
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.vocabulary import parse
from fieldcal.solve import solve

UNEXAMINED = {"model": {"effects": ["nonsense"]}}
"""Of a session whose samples are not examined the means alone show the tilt."""

PLACES = tuple(Position.deg(a, b) for a, b in NINE[:6])


def shown(tilt_deg: float, angles_deg: float, rng: np.random.Generator) -> float:
    """Chi-squared of the tilt of a base that is stated to be level to 0.1 deg."""
    base = np.full(2, tilt_deg) + rng.normal(0, 0.1, 2)
    mean = outputs(PLACES, base_deg=base.tolist()) + rng.normal(0, 1e-3, (6, 3))
    seen = observe(PLACES, mean, sigma=1e-3)
    asked: dict[str, Any] = {"level_sigma_deg": 0.1, "angle_sigma_deg": angles_deg}
    found: Calibration = solve(seen, **asked)
    told = with_tilt_shown(found, seen, None, asked).info["tilt_shown"]
    assert told["dof"] == 2
    return float(told["chi2"])


@pytest.mark.thorough
def test_of_a_true_statement_it_is_that_of_two_degrees_of_freedom() -> None:
    rng = np.random.default_rng(4)
    chi2 = [shown(0.0, 1e-3, rng) for _ in range(40)]
    assert np.mean(chi2) == pytest.approx(2.0, abs=0.85)  # 2.7 standard errors
    assert max(chi2) < 18


@pytest.mark.parametrize(
    ("tilt_deg", "tables"),
    [
        (0.5, UNEXAMINED),
        pytest.param(0.0, {}, marks=pytest.mark.thorough),
        pytest.param(0.5, {}, marks=pytest.mark.thorough),
    ],
)
def test_a_base_that_is_not_as_level_as_stated_is_no_go(
    tilt_deg: float,
    tables: dict[str, Any],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    tilt = parse(f"base_tilt:about_x_deg={tilt_deg}")
    held = places(NINE)
    site = {**SITE, "level_deg": 0.01, "angle_setting_deg": 0.01}
    run = {"procedure": "positions"}
    block = recorded(Profile().having(tilt), held)
    folder = write_session(tmp_path / "s", block, held, site=site, run=run, **tables)
    main(["solve", str(folder), "--json"])
    checks = json.loads(capsys.readouterr().out)["decision"]["checks"]
    (level,) = [check for check in checks if check["name"] == "level"]
    assert level["ok"] == (tilt_deg == 0.0)
    assert ("show a tilt of" in level["says"]) == (tilt_deg > 0)
