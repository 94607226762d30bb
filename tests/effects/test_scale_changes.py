"""Scale factors that change by themselves, and what a calibration makes of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import CALM, WIDE, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Sensor
from fieldcal.physics.experience import Experience
from fieldcal.sim_device.vocabulary import checked_effect

T = np.array([0.0, 4.0, 10.0, 30.0])


def felt() -> Experience:
    """Four rows of two seconds, in four attitudes."""
    alpha, beta = np.random.default_rng(1).uniform(-1.5, 1.5, (2, 4))
    warming = np.array([0.0, 1.0, -2.0, 3.0])
    return Experience.at_rest(
        alpha, beta, 9.8, t=T, since_start=T, lasts=np.full(4, 2.0), warming=warming
    )


@pytest.mark.parametrize(
    ("name", "course"),
    [
        ("scale_drift", T),
        ("scale_step", np.array([0.0, 0.0, 0.25, 1.0])),
        ("scale_warm_up", np.exp(-T / 8.0)),
        ("scale_transient", np.array([0.0, 0.0, 0.0, 1 - np.exp(-19.5 / 8.0)])),
        ("temperature_scale", np.array([0.0, 1.0, -2.0, 3.0])),
    ],
)
def test_each_accelerometer_changes_by_its_own_force(name: str, course: Array) -> None:
    """By a quarter in the mean of which a quarter lies after the step."""
    x, effect = felt(), catalogue()[name]
    assert isinstance(effect, Sensor)
    values = np.array([2.0, -3.0, 5.0])
    out = effect.change_of_outputs(x, values, {"at_s": 10.5, "tau_s": 8.0})
    np.testing.assert_allclose(out[:, :3], course[:, None] * x.f * values)
    assert not out[:, 3:].any()


def test_where_a_thermometer_shows_a_change_a_drift_is_that_of_the_temperature() -> (
    None
):
    drift, x = catalogue()["scale_drift"], felt()
    assert drift.chance(x) < 0.2 * drift.chance(replace(x, warming=np.zeros(4)))


@pytest.mark.parametrize(
    "hidden",
    [
        {"scale_drift": {"x": -2e-5, "y": -2e-5, "z": -2e-5}},
        {"scale_step": {"x": 4e-3, "y": -3e-3, "z": 2e-3, "at_s": 7.0}},
        {
            "scale_transient": {
                "x": 8e-3,
                "y": -6e-3,
                "z": 6e-3,
                "at_s": 7.0,
                "tau_s": 60,
            }
        },
    ],
)
@pytest.mark.thorough
def test_scale_factors_are_those_of_the_end(
    hidden: dict[str, dict[str, float]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Which a flight begins with; the device was simulated with those of the start."""
    taken = places(WIDE)
    ((name, values),) = hidden.items()
    if "at_s" in values:
        values = {**values, "at_s": taken[4]["start_s"] + values["at_s"]}
    effect = checked_effect(name, values)
    profile = replace(CALM, effects=(*CALM.effects, effect))
    write_session(tmp_path / "s", recorded(profile, taken, 5), taken)
    main(["solve", str(tmp_path / "s"), "--json", "--angles", "0.002"])
    said = json.loads(capsys.readouterr().out)
    assert said["carried"]["causes"][name] > 0.9
    lasted = taken[-1]["end_s"] if name == "scale_drift" else 1.0
    if "tau_s" in values:
        lasted = -np.expm1(-(taken[-1]["end_s"] - values["at_s"]) / values["tau_s"])
    change = lasted * np.array([values[i] for i in "xyz"])
    found = said["parameters"]["acc_scale"]
    off = np.array(found["value"]) - profile.truth.acc_scale - change
    sigma = np.array(found["sigma"])
    assert (np.abs(off) < 4 * sigma).all() and (sigma < np.abs(change) / 3).all()
