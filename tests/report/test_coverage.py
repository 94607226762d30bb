"""Where gravity pointed, against directions and variances written out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.report.coverage import Coverage, force_sigma, sphere_directions
from fieldcal.sim_device.profile import Profile

NAMES = tuple(f"acc_{g}.{a}" for g in ("bias", "scale") for a in "xyz")
UNITS = ("m/s^2",) * 3 + ("1",) * 3


def calibration(covariance: np.ndarray) -> Calibration:
    values = np.array([0.1, 0.2, 0.3, 2.0, 1.0, 1.0])
    return Calibration("scalar", NAMES, values, covariance, UNITS, 1.0, 1, 1e-3)


def test_the_spiral_is_even() -> None:
    d = sphere_directions(4000)
    np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1.0)
    # an even sphere: of every axis the mean is 0 and the mean square a third
    np.testing.assert_allclose(d.mean(axis=0), 0.0, atol=2e-3)
    np.testing.assert_allclose(d.T @ d / len(d), np.eye(3) / 3, atol=2e-3)


def test_the_farthest_direction_is_across_from_what_was_seen() -> None:
    upper = sphere_directions(400)
    forces = 9.81 * upper[upper[:, 2] > 0]
    found = Coverage.of(forces, calibration(1e-6 * np.eye(6)), 9.81)
    assert found.gap_deg == pytest.approx(90.0, abs=6.0)
    assert found.farthest[2] < -0.99
    faces = 9.81 * np.vstack([np.eye(3), -np.eye(3)])
    corner = Coverage.of(faces, calibration(1e-6 * np.eye(6)), 9.81)
    assert corner.gap_deg == pytest.approx(np.rad2deg(np.arccos(3**-0.5)), abs=2.5)


def test_the_uncertainty_is_that_of_drawn_calibrations() -> None:
    rng = np.random.default_rng(2)
    root = rng.normal(0, 1e-3, (6, 6))
    found = calibration(root @ root.T)
    force = 9.81 * sphere_directions(5)
    raw = found.values[:3] + found.values[3:] * force
    drawn = rng.multivariate_normal(found.values, found.covariance, 20_000)
    back = (raw[:, None] - drawn[:, :3]) / drawn[:, 3:]
    spread = np.sqrt(((back - force[:, None]) ** 2).mean(axis=1).sum(axis=1))
    np.testing.assert_allclose(force_sigma(found, force), spread, rtol=0.03)


@pytest.mark.parametrize(
    "known", [pytest.param(True, marks=pytest.mark.thorough), False]
)
def test_a_report_says_it_of_positions_without_angles(
    known: bool, tmp_path: Path
) -> None:
    held = places(
        [(0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90), (45, 40)], 8.0
    )
    block = recorded(Profile(), held)
    told = [{k: v for k, v in p.items() if known or "deg" not in k} for p in held]
    folder = write_session(tmp_path / "s", block, told)
    main(["solve", str(folder)])
    main(["report", str(folder)])
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert ("What the positions cover" in page) is not known
