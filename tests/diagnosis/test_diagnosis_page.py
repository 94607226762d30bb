"""What a page about a diagnosis needs: what was tried, residuals with covariates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.diagnosis import Diagnosis, diagnose
from fieldcal.diagnosis.result import Curve
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import Climate, NoiseFigures, Profile
from fieldcal.sim_device.vocabulary import parse

CLIMATE = Climate(points=((0.0, 20.0), (120.0, 30.0), (250.0, 22.0)))
QUIET = NoiseFigures(acc_instability=(0, 0, 0), gyr_instability=(0, 0, 0))


def found_in(folder: Path, *effects: str, seed: int = 1, **more: object) -> Diagnosis:
    device = replace(Profile(noise=QUIET), effects=tuple(map(parse, effects)), **more)  # type: ignore[arg-type]
    positions = places()
    session = Session.open(
        write_session(folder, recorded(device, positions, seed), positions)
    )
    return diagnose(session.block, session.about)


@pytest.fixture(scope="module")
def warmed(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """A bias that follows a temperature, and three seconds of a stuck gyroscope."""
    return found_in(
        tmp_path_factory.mktemp("warmed"),
        "temperature_bias:ax=0.01",
        "stuck:channel=gy,from_s=40,to_s=43",
        temperature=CLIMATE,
    )


@pytest.fixture(scope="module")
def tilted(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """A tilted base, and three seconds in which a gyroscope says the same."""
    return found_in(
        tmp_path_factory.mktemp("tilted"),
        "base_tilt:about_x_deg=1,about_z_deg=-0.7",
        "stuck:channel=gy,from_s=40,to_s=43",
    )


@pytest.mark.thorough
def test_the_league_says_why_each_lost(tilted: Diagnosis) -> None:
    found = tilted
    tried = {c.id: c for c in found.candidates}
    assert {"base_tilt", "angle_offset", "cross_coupling", "bias_drift"} <= set(tried)
    assert [c.id for c in found.candidates if c.chosen] == ["base_tilt"]
    assert not tried["base_tilt"].why
    assert "base_tilt already explains it" in tried["angle_offset"].why
    assert all(c.why for c in found.candidates if not c.chosen)
    squares = [c.delta_chi2 for c in found.candidates]
    assert squares == sorted(squares, reverse=True)
    # a base that is tilted predicts what it was not fitted to; its rival does less well
    assert tried["base_tilt"].held_out_gain > tried["angle_offset"].held_out_gain > 0


@pytest.mark.thorough
def test_of_a_clean_recording_everything_lost_to_chance(tmp_path: Path) -> None:
    found = found_in(tmp_path)
    assert found.verdict == "consistent" and not found.curves and not found.next
    assert all("no more than chance" in c.why for c in found.candidates)


@pytest.mark.thorough
def test_scatter_is_not_predicted_by_an_equation(tmp_path: Path) -> None:
    found = found_in(tmp_path, "angle_setting:sigma_deg=0.3", seed=5)
    strongest = found.candidates[0]
    assert not strongest.chosen and "angle_setting" in strongest.why
    assert any("average out" in text for text in found.next)


def test_residuals_over_the_temperature_that_they_follow(warmed: Diagnosis) -> None:
    curve = follows(warmed, "temperature", "°C")
    assert set(curve.position) == set(range(9))
    assert 20 < curve.x.min() < 23 and 28 < curve.x.max() < 33
    assert abs(np.corrcoef(curve.x, curve.before)[0, 1]) > 0.9


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("concealed", "covariate", "unit"),
    [
        ("settling:ax=0.05,tau_s=4", "time since the turn", "s"),
        ("base_tilt:about_z_deg=1", "position", ""),
    ],
)
def test_residuals_over_what_they_follow(
    concealed: str, covariate: str, unit: str, tmp_path: Path
) -> None:
    found = found_in(tmp_path, concealed, temperature=CLIMATE)
    curve = follows(found, covariate, unit)
    assert set(curve.position) == set(range(9))


def follows(found: Diagnosis, covariate: str, unit: str) -> Curve:
    """The curve of a_x, which follows something that is taken out of it."""
    curve = next(c for c in found.curves if c.channel == "ax")
    assert (curve.covariate, curve.unit) == (covariate, unit)
    before, after = curve.before / curve.sigma, curve.after / curve.sigma
    assert np.sqrt(np.mean(before**2)) > 3 * np.sqrt(np.mean(after**2))
    assert 0.7 < np.sqrt(np.mean(after**2)) < 1.8
    return curve


def test_what_to_do_next(warmed: Diagnosis) -> None:
    found = warmed
    cures = [text.partition(":")[0] for text in found.next]
    assert cures[:2] == ["temperature_bias", "stuck at position 2"]
    assert any('effects = ["temperature_bias"]' in text for text in found.next)
    assert found.to_json()["next"] == list(found.next)
