"""Patches, read as the simulators they are for read them."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

from fieldcal.against import patches
from fieldcal.against.facts import effects_with_equation
from fieldcal.against.result import (
    Difference,
    Facts,
    Match,
    RealAndSimulated,
    SimulatorPrediction,
)
from fieldcal.against.sensor_model import SensorModel, patch_model
from fieldcal.commands import diagnose
from fieldcal.core.samples import Array
from fieldcal.diagnosis.result import Quantity
from fieldcal.sim_device import profile_file

BIAS, SCALE = np.array([0.05, -0.03, 0.1]), np.array([1.004, 0.997, 1.001])
GYRO = np.array([1e-3, -2e-3, 5e-4])
FORCE, RATE = np.array([9.0, -3.0, 2.0]), np.array([0.5, -0.2, 0.1])
MODEL = SensorModel(
    {"acc_bias": BIAS, "acc_scale": SCALE, "gyr_bias": GYRO},
    {"ax": 0.02, "ay": 0.02, "az": 0.03, "gx": 1e-3, "gy": 1e-3, "gz": 2e-3},
    {
        "gyro_scale": {"s1": 0.01, "s3": -0.02},
        "cross_coupling": {"k21": 0.002},
        "temperature_bias": {"ax": 3e-3, "gz": -1e-5},
        "lever_arm": {"x": 0.1, "y": 0.0, "z": -0.05},
    },
    rate_hz=100.0,
    start_c=21.0,
)
ACC = SCALE * FORCE + BIAS
GYR = (1 + np.array([0.01, 0, -0.02])) * RATE + GYRO


def written(name: str, tmp_path: Path, model: SensorModel = MODEL) -> tuple[str, str]:
    path = tmp_path / f"patch{patches.patch_format(name).ENDING}"
    says = patches.write(name, model, path)
    return path.read_text("utf-8"), "; ".join(says)


def parameters(text: str, name: int, value: int) -> dict[str, float]:
    rows = [line.split() for line in text.splitlines() if line[0] != "#"]
    return {row[name]: float(row[value]) for row in rows}


def axes(found: dict[str, float], name: str) -> Array:
    return np.array([found[name.format(axis)] for axis in "XYZ"])


def test_sitl_makes_what_the_device_makes(tmp_path: Path) -> None:
    text, says = written("sitl", tmp_path)
    found = parameters(text, 0, 1)
    acc = FORCE / axes(found, "SIM_ACC1_SCAL_{}") + axes(found, "SIM_ACC1_BIAS_{}")
    np.testing.assert_allclose(acc, ACC, rtol=1e-7)
    scale = 1 + axes(found, "SIM_GYR1_SCALE_{}") * 0.01
    np.testing.assert_allclose(
        RATE * scale + axes(found, "SIM_GYR1_BIAS_{}"), GYR, rtol=1e-7
    )
    middle = (found["SIM_IMUT1_TMIN"] + found["SIM_IMUT1_TMAX"]) / 2
    warmer = axes(found, "SIM_IMUT1_ACC1_{}") * (31.0 - middle) * 1e-6
    np.testing.assert_allclose(warmer, [3e-2, 0, 0], rtol=1e-7)
    assert axes(found, "SIM_IMU_POS_{}").tolist() == [0.1, 0.0, -0.05]
    assert "nothing for cross coupling (k21 = 0.002)" in says
    assert "nothing for noise" in says and "fixed" in says


def test_gazebo_has_the_bias_where_it_keeps_its_sign(tmp_path: Path) -> None:
    steps = {"quantisation": {"acc": 0.01}}
    model = SensorModel({"acc_bias": BIAS}, MODEL.noise, steps, rate_hz=100.0)
    text, says = written("gazebo", tmp_path, model)
    imu = ElementTree.fromstring(text)
    for i, axis in enumerate("xyz"):
        noise = imu.find(f"linear_acceleration/{axis}/noise")
        assert noise is not None and noise.get("type") == "gaussian_quantized"
        assert float(noise.findtext("mean", "")) == pytest.approx(BIAS[i])
        assert float(noise.findtext("stddev", "")) == MODEL.noise[f"a{axis}"]
        assert float(noise.findtext("precision", "")) == 0.01
        assert noise.find("bias_mean") is None, "that has either sign"
        rate = imu.find(f"angular_velocity/{axis}/noise")
        assert rate is not None and rate.get("type") == "gaussian"
        assert float(rate.findtext("stddev", "")) == MODEL.noise[f"g{axis}"]
    assert "nothing for acc scale" in written("gazebo", tmp_path)[1]
    assert "100" in says


def test_noise_that_no_comparison_has_shown_is_not_written_as_none(
    tmp_path: Path,
) -> None:
    """A motion shows no noise of the simulator: a <stddev> of 0 would take it away."""
    model = SensorModel({"acc_bias": BIAS}, shown=SensorModel())
    text, says = written("gazebo", tmp_path, model)
    assert "<mean>0.05</mean>" in text and "stddev" not in text
    assert "write its own <stddev> of linear_acceleration" in says
    known = SensorModel({"acc_bias": BIAS}, shown=SensorModel(noise={"ax": 0.02}))
    text, says = written("gazebo", tmp_path, known)
    assert "<stddev>0.02</stddev>" in text and "stddev" not in says


def test_px4_takes_the_opposite_out_of_its_perfect_sensors(tmp_path: Path) -> None:
    text, says = written("px4", tmp_path)
    found = parameters(text, 2, 3)
    off, scale = (axes(found, f"CAL_ACC0_{{}}{what}") for what in ("OFF", "SCALE"))
    np.testing.assert_allclose((FORCE - off) * scale, ACC, rtol=1e-7)
    np.testing.assert_allclose(
        RATE - axes(found, "CAL_GYRO0_{}OFF"), RATE + GYRO, rtol=1e-7
    )
    assert "nothing for gyro scale" in says and "fixed" in says


def test_kalibr_has_matrices_and_densities(tmp_path: Path) -> None:
    text, says = written("kalibr", tmp_path)
    found = yaml.safe_load(text)
    coupled = np.diag(SCALE)
    coupled[1, 0] = 0.002
    acc = found["accelerometers"]
    np.testing.assert_allclose(acc["M"], coupled)
    np.testing.assert_allclose(acc["bias"], BIAS)
    gyr = found["gyroscopes"]
    whole = np.array(gyr["M"]) @ np.array(gyr["C_gyro_i"])
    np.testing.assert_allclose(whole @ RATE + gyr["bias"], GYR, rtol=1e-9)
    assert found["accelerometer_noise_density"] == pytest.approx(0.003)
    assert found["gyroscope_noise_density"] == pytest.approx(2e-4)
    assert "nothing for temperature bias" in says


def test_what_nothing_shows_is_said_where_a_matrix_must_hold_it(tmp_path: Path) -> None:
    shown = SensorModel({"gyr_scale": SCALE}, {}, {"gyro_cross_coupling": {"s12": 0.1}})
    model = SensorModel({"acc_scale": SCALE}, shown=shown)
    text, says = written("kalibr", tmp_path, model)
    for one in ("acc_bias", "cross_coupling", "gyr_bias", "gyro_scale"):
        assert f"# {one}: not shown, as of a perfect sensor\n" in text
        assert one.replace("_", " ") in says
    for one in ("acc_scale", "gyr_scale", "gyro_cross_coupling"):
        assert f"# {one}:" not in text
    text, says = written("json", tmp_path, model)
    assert json.loads(text)["assumed"] == ["cross_coupling"]
    assert "cross coupling: neither recording nor simulator shows it" in says


def test_the_virtual_device_takes_its_tables(tmp_path: Path) -> None:
    written("toml", tmp_path)
    device = profile_file.read_profile(tmp_path / "patch.toml")
    assert device.truth.acc_bias == tuple(BIAS) and device.sampling.rate_hz == 100.0
    assert device.noise.gyr == (1e-3, 1e-3, 2e-3)
    there = {e.id for e in device.effects}
    assert there == {"gyro_scale", "cross_coupling", "temperature_bias", "lever_arm"}


def test_json_has_everything_with_its_equation(tmp_path: Path) -> None:
    text, says = written("json", tmp_path)
    found = json.loads(text)
    acc = np.array(found["matrix"]["acc"]) @ FORCE + found["bias"]["acc"]
    np.testing.assert_allclose(acc - ACC, [0, 0.002 * FORCE[0], 0], atol=1e-12)
    gyr = np.array(found["matrix"]["gyr"]) @ RATE + found["bias"]["gyr"]
    np.testing.assert_allclose(gyr, GYR)
    warm = found["effects"]["temperature_bias"]
    assert warm["ax"] == 3e-3 and "T" in warm["equation"]
    assert says.startswith("gyr scale, gyro cross coupling: neither")


def test_what_is_not_changed_stays_where_one_element_holds_several(
    tmp_path: Path,
) -> None:
    """Gazebo's <noise> has bias and noise, Kalibr's M scale factors and the rest."""
    shown = SensorModel({"acc_scale": SCALE}, MODEL.noise, {
        "cross_coupling": {"k21": 0.002}
    })  # fmt: skip
    model = SensorModel({"acc_bias": BIAS}, shown=shown, rate_hz=100.0)
    assert model.changed == ("acc_bias",)
    imu = ElementTree.fromstring(written("gazebo", tmp_path, model)[0])
    assert imu.findtext("linear_acceleration/z/noise/stddev") == "0.03"
    assert imu.find("angular_velocity") is None
    acc = yaml.safe_load(written("kalibr", tmp_path, model)[0])["accelerometers"]
    assert acc["M"][1][:2] == [0.002, 0.997] and acc["bias"] == BIAS.tolist()
    found = parameters(written("px4", tmp_path, model)[0], 2, 3)
    np.testing.assert_allclose(axes(found, "CAL_ACC0_{}SCALE"), SCALE)


def test_a_triad_that_neither_has_keeps_the_noise_of_the_simulator(
    tmp_path: Path,
) -> None:
    """Accelerometers alone: no gyroscope is made to be without noise."""
    loud = {"ax": 0.02, "ay": 0.02, "az": 0.03}
    shown = SensorModel(noise=dict.fromkeys(loud, 0.01))
    model = SensorModel(noise=loud, shown=shown, rate_hz=100.0)
    found = yaml.safe_load(written("kalibr", tmp_path, model)[0])
    assert found["accelerometer_noise_density"] == pytest.approx(0.003)
    assert "gyroscope_noise_density" not in found
    path = tmp_path / "patch.toml"
    patches.write("toml", model, path)
    noise = profile_file.read_profile(path).noise
    assert noise.acc == (0.02, 0.02, 0.03) and noise.gyr == type(noise)().gyr
    # what the simulator shows of it is known, and is 0 where it has none
    both = SensorModel(noise=loud, shown=SensorModel(noise={"gx": 0.0}), rate_hz=100.0)
    found = yaml.safe_load(written("kalibr", tmp_path, both)[0])
    assert found["gyroscope_noise_density"] == 0


def test_an_instant_counts_from_the_start_of_the_recording_that_has_it(
    tmp_path: Path,
) -> None:
    """A step that only the simulator has, whose clock is far behind the recording's."""
    here, there = (
        Facts(100.0, np.nan, np.nan, start, np.nan, {}) for start in (1e5, 10.0)
    )
    step, at = Quantity(0.1, 1e-3, "m/s^2"), Quantity(60.0, 0.1, "s")
    away, before = Quantity(-0.1, 1e-3, "m/s^2"), Quantity(-60.0, 0.1, "s")
    pairs = {
        "ax": RealAndSimulated(None, step, away),
        "at_s": RealAndSimulated(None, at, before),
    }
    none = SimulatorPrediction(0.0, 0.0, 1.0)
    found = Match("left_out", 1.0, (Difference("bias_step", "added", 1.0, pairs),), (),
                  none, none, here, there, (), "")  # fmt: skip
    model = patch_model(found)
    assert model.effects["bias_step"] == {"ax": 0.0, "at_s": 50.0}
    assert "bias step" not in written("toml", tmp_path, model)[1]


def quantity(value: float, unit: str) -> Quantity:
    return Quantity(value, 1e-6, unit)


def facts(**shown: Any) -> Facts:
    return Facts(100.0, np.nan, np.nan, 10.0, np.nan, {}, **shown)


def resized(name: str, real: Facts, sim: Facts, *names: str) -> Match:
    """A comparison in which these parameters of something differ."""
    one, two = ({**f.calibration, **f.effects}[name] for f in (real, sim))
    pairs = {n: RealAndSimulated.of(one[n], two[n]) for n in names}
    none = SimulatorPrediction(0.0, 0.0, 1.0)
    differs = (Difference(name, "resized", 1.0, pairs),)
    return Match("left_out", 1.0, differs, (), none, none, real, sim, (), "")


def test_an_axis_of_which_the_recording_says_nothing_stays_as_it_is() -> None:
    """A recording without gz, and a simulator with a bias of 0.3 there."""
    x, y, z = (quantity(v, "rad/s") for v in (0.02, 0.01, 0.3))
    real = facts(calibration={"gyr_bias": {"x": x, "y": y}})
    sim = facts(calibration={"gyr_bias": {"x": y, "y": x, "z": z}})
    first = patch_model(resized("gyr_bias", real, sim, "x", "y"))
    assert first.group("gyr_bias") == pytest.approx([0.02, 0.01, 0.3])
    then = patch_model(resized("gyr_bias", real, sim, "x"), first)
    assert then.group("gyr_bias") == pytest.approx([0.03, 0.01, 0.3])


def test_a_parameter_that_does_not_differ_stays_as_the_simulator_has_it() -> None:
    """Coefficients of one triad differ; instants count from the first sample."""
    slopes = {"ax": quantity(1e-3, "m/s^2/K"), "gz": quantity(1e-5, "rad/s/K")}
    real = facts(effects={"temperature_bias": {"ax": quantity(3e-3, "m/s^2/K")}})
    sim = facts(effects={"temperature_bias": slopes})
    model = patch_model(resized("temperature_bias", real, sim, "ax"))
    assert model.effects["temperature_bias"] == pytest.approx({"ax": 3e-3, "gz": 1e-5})
    steps = {"ax": quantity(0.1, "m/s^2"), "at_s": quantity(60.0, "s")}
    real = facts(effects={"bias_step": {"ax": quantity(0.2, "m/s^2")}})
    step = patch_model(
        resized("bias_step", real, facts(effects={"bias_step": steps}), "ax")
    )
    assert step.effects["bias_step"] == pytest.approx({"ax": 0.2, "at_s": 50.0})


def test_an_effect_of_two_triads_is_known_with_both(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each triad is a cause of its own, with the same name."""
    slopes = {"ax": quantity(1e-3, "m/s^2/K"), "gz": quantity(1e-5, "rad/s/K")}
    triads = {name[0]: {name: slope} for name, slope in slopes.items()}
    cause = SimpleNamespace(kind="effect", name="temperature_bias")
    there: Any = SimpleNamespace(
        set=SimpleNamespace(members=[(cause, triad) for triad in triads])
    )
    monkeypatch.setattr(
        "fieldcal.against.facts.cause_quantities", lambda _, member: triads[member[1]]
    )
    found = effects_with_equation(there)
    assert found == {"temperature_bias": slopes}


@pytest.mark.parametrize("name", patches.formats())
def test_a_patch_that_changes_nothing_is_a_file_of_its_format(
    name: str, tmp_path: Path
) -> None:
    text, says = written(name, tmp_path, SensorModel())
    assert text.endswith("\n") and "nothing for" not in says


def test_the_command_knows_all_formats() -> None:
    import argparse

    parser = argparse.ArgumentParser()
    diagnose.add_arguments(parser)
    (patch,) = [a for a in parser._actions if a.dest == "patch"]
    assert tuple(patch.choices or ()) == patches.formats()


def test_what_the_virtual_device_cannot_have_is_said_and_the_rest_written(
    tmp_path: Path,
) -> None:
    model = SensorModel(effects={"bandwidth": {"acc": -3e-6, "gyr": 0.01}})
    says = patches.write("toml", model, tmp_path / "patch.toml")
    assert any("bandwidth acc = -3e-06 is left out" in one for one in says)
    device = profile_file.read_profile(tmp_path / "patch.toml")
    (one,) = (e for e in device.effects if e.id == "bandwidth")
    assert one["gyr"] == 0.01 and one["acc"] == 0.0
