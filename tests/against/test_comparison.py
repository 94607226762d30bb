"""A numpy simulator held against recordings of a device that has more, or less."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import strapdown
from small_sessions import dictionary, ladder
from strapdown_sessions import DEVICE, played

from fieldcal.against import Match, compare, compare_sides
from fieldcal.against.side import DiagnosedRecording, diagnose_side
from fieldcal.against.widened import with_all_parameters
from fieldcal.core.samples import Array
from fieldcal.model import thresholds

LATER = 40.0
"""By how much later the simulator begins, s."""


@pytest.fixture(scope="module")
def real() -> DiagnosedRecording:
    return diagnose_side("real", *played(DEVICE, 1))


def against(real: DiagnosedRecording, device: dict[str, Any], seed: int = 2) -> Match:
    return compare_sides(
        real, diagnose_side("simulator", *played(device, seed, LATER), real)
    )


@pytest.mark.thorough
def test_a_simulator_without_the_earths_rate() -> None:
    quiet = {"noise": {"acc": [0.005] * 3, "gyr": [5e-5] * 3}}
    block, about = played(quiet, 1)
    felt = replace(block, gyr=block.gyr + strapdown.earth())
    found = compare((felt, about), played(quiet, 2))
    assert [(d.id, d.direction) for d in found.differences] == [
        ("earth_rate", "left_out")
    ]
    north, sigma = value(found, "earth_rate", "z")
    assert abs(north - 7.292e-5 * np.cos(0.88)) < 4 * sigma
    assert found.before.chi2_per_dof > 2 > 1.2 > found.after.chi2_per_dof


@pytest.mark.thorough
def test_outputs_that_the_simulator_has_not_are_left_aside(
    real: DiagnosedRecording,
) -> None:
    block, about = played(DEVICE, 2)
    blind = replace(block, gyr=np.full_like(block.gyr, np.nan))
    found = compare_sides(real, diagnose_side("simulator", blind, about, real))
    assert found.verdict == "consistent"
    assert found.before.chi2_per_dof == pytest.approx(1.0, abs=0.15)
    assert any("nothing of gx, gy, gz" in warning for warning in found.warnings)


def value(found: Match, name: str, parameter: str) -> tuple[float, float]:
    one = next(d for d in found.differences if d.id == name)
    off = one.parameters[parameter].difference
    assert off.sigma is not None
    return float(off.value), off.sigma


@pytest.mark.thorough
def test_a_simulator_that_is_like_the_device_agrees(real: DiagnosedRecording) -> None:
    found = against(real, DEVICE)
    assert found.verdict == "consistent" and not found.differences
    assert found.alike == ("cross_coupling",)
    assert found.before.chi2_per_dof == pytest.approx(1.0, abs=0.15)


@pytest.mark.thorough
def test_what_is_not_likely_enough_is_no_difference_and_is_told(
    real: DiagnosedRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    louder = {**DEVICE, "noise": {"acc": [0.0208] * 3, "gyr": [1e-3] * 3}}
    sim = diagnose_side("simulator", *played(louder, 2, LATER), real)
    (sure,) = compare_sides(real, sim).differences
    assert sure.id == "noise" and sure.probability > 0.9
    for asked, said in ((sure.probability, 1), (sure.probability + 1e-9, 0)):
        monkeypatch.setattr(thresholds, "DIFFERS", asked)
        found = compare_sides(real, sim)
        assert len(found.differences) == said
        assert found.verdict == ("left_out" if said else "consistent")
        told = [w for w in found.warnings if "may differ, with a probability of" in w]
        assert len(told) == 1 - said
        assert all(w.startswith("noise (ax ") for w in told)


def test_numbers_of_an_effect_are_told_with_it_on_all_axes() -> None:
    """Alone on one axis, the others are in the scale factor; a refined shape stays."""
    d = dictionary(ladder())
    cause = next(c for c in d.causes if c.name == "scale_asymmetry")
    one = next(v for v in cause.variants if v.params == (1,))
    assert with_all_parameters((cause, one))[1].params == (0, 1, 2)
    drift = next(c for c in d.causes if c.key == "settling:acc")
    narrow = next(v for v in drift.variants if len(v.params) == 1)
    whole = with_all_parameters((drift, narrow))[1]
    assert whole.params == (0, 1, 2) and whole.shape == narrow.shape
    exact = replace(narrow, shape={"tau_s": 3.21})
    assert with_all_parameters((drift, exact))[1] is exact


def test_what_is_alike_is_told_beside_what_differs(real: DiagnosedRecording) -> None:
    found = against(real, {"matrix": DEVICE["matrix"]})
    assert found.alike == ("cross_coupling",)
    said = {(d.id, d.direction) for d in found.differences}
    assert said == {
        ("acc_bias", "resized"), ("gyr_bias", "resized"), ("noise", "left_out")
    }  # fmt: skip
    for name, group in (("acc_bias", "acc"), ("gyr_bias", "gyr")):
        off: Array = np.array([value(found, name, axis) for axis in "xyz"])
        assert (np.abs(off[:, 0] - DEVICE["bias"][group]) < 4 * off[:, 1]).all()
    assert found.before.chi2_per_dof > 100 and found.after.chi2_per_dof < 1.2
    assert any("next to no noise" in warning for warning in found.warnings)


@pytest.mark.thorough
def test_a_perfect_simulator_leaves_out_everything(real: DiagnosedRecording) -> None:
    found = against(real, {})
    said = {(d.id, d.direction) for d in found.differences}
    assert said == {
        ("acc_bias", "resized"), ("acc_scale", "resized"), ("gyr_bias", "resized"),
        ("cross_coupling", "left_out"), ("noise", "left_out"),
    }  # fmt: skip
    off: Array = np.array([value(found, "acc_bias", axis) for axis in "xyz"])
    assert (np.abs(off[:, 0] - DEVICE["bias"]["acc"]) < 4 * off[:, 1]).all()
    k21, sigma = value(found, "cross_coupling", "k21")
    assert abs(k21 - 0.002) < 4 * sigma < 4e-4
    assert found.before.chi2_per_dof > 100 and found.after.chi2_per_dof < 1.2
    assert found.before.rms_acc > 20 * found.after.rms_acc
    assert any("next to no noise" in warning for warning in found.warnings)


@pytest.mark.thorough
def test_of_what_the_simulator_has_too_little_of_both_numbers_are_told(
    real: DiagnosedRecording,
) -> None:
    """By itself it shows none of it: its size is the device's."""
    weak = {"acc": [[1.004, 0, 0], [2e-4, 0.997, 0], [0, 0, 1.001]]}
    found = against(real, {**DEVICE, "matrix": weak}, 3)
    (one,) = found.differences
    assert (one.id, one.direction) == ("cross_coupling", "resized")
    assert set(one.parameters) == {"k12", "k13", "k21", "k23", "k31", "k32"}
    for name, number in one.parameters.items():
        assert number.simulator and number.simulator.sigma
        true = 2e-4 * (name == "k21")
        off = abs(float(number.simulator.value) - true)
        assert off < 2.6 * number.simulator.sigma < 3e-4
    off, sigma = value(found, "cross_coupling", "k21")
    assert abs(off - 1.8e-3) < 4 * sigma < 1e-3


@pytest.mark.thorough
def test_what_the_simulator_has_beyond_the_device_has_the_other_direction(
    real: DiagnosedRecording,
) -> None:
    more = {
        **DEVICE,
        "effects": {"quadratic": {"z": 3e-4}},
        "matrix": {"acc": [[1.004, 0, 0], [0.004, 0.997, 0], [0, 0, 1.001]]},
        "noise": {"acc": [0.02] * 3, "gyr": [1.5e-3] * 3},
    }
    found = against(real, more)
    said = {d.id: d.direction for d in found.differences}
    assert said == {
        "quadratic": "added", "cross_coupling": "resized", "noise": "resized"
    }  # fmt: skip
    z, sigma = value(found, "quadratic", "z")
    assert abs(z + 3e-4) < 4 * sigma, "recording less simulator"
    k21, sigma = value(found, "cross_coupling", "k21")
    assert abs(k21 + 0.002) < 4 * sigma
    noise, sigma = value(found, "noise", "gx")
    assert abs(noise + 5e-4) < 4 * sigma
    quadratic = next(d for d in found.differences if d.id == "quadratic")
    assert {m.channel for m in quadratic.where} == {"az"}
    assert "The simulator adds quadratic" in found.says
