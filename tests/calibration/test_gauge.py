"""Samples in volts or counts: the same calibration, in their unit."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from session_folders import NINE, places, recorded, write_session

from fieldcal.calibration import Calibration
from fieldcal.calibration.document import schema
from fieldcal.calibration.gauge import Gauge, in_sample_units, in_si_units
from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.vocabulary import parse

ACC, GYR = 2**15 / (8 * 9.80665), 2**15 / np.deg2rad(1000)
"""Counts of a device of 8 g and 1000 deg/s."""

COUPLED = "cross_coupling:k12=0.003,k31=0.002"

SEEN = {"gyr_bias": (0.011, -0.02, 0.006)}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One session in SI, and the same in counts and in volts."""
    device = Profile(effects=(parse("earth_rate:"), parse(COUPLED)))
    positions, out = places(NINE[:6], seconds=15.0), {}
    block = recorded(device, positions)
    for unit, acc, gyr in (("SI", 1.0, 1.0), ("count", ACC, GYR), ("V", 0.2, 3.0)):
        folder = tmp_path_factory.mktemp(unit)
        units = {"acceleration": unit, "angular_rate": unit} if unit != "SI" else {}
        nominal = {
            "acc_scale": [acc] * 3,
            "gyr_scale": [gyr] * 3,
            "gyr_bias": [gyr * b for b in SEEN["gyr_bias"]],
        }
        scaled = replace(block, acc=block.acc * acc, gyr=block.gyr * gyr)
        limits = {"acceleration": 78.0 * acc, "angular_rate": 17.0 * gyr}
        write_session(
            folder, scaled, positions, units=units, nominal=nominal, range=limits
        )
        out[unit] = folder
    return out


def solved_in(folder: Path) -> dict[str, Any]:
    """The result of a session, which is in its folder as well."""
    assert main(["solve", str(folder), "--cross"]) == 0
    out: dict[str, Any] = json.loads((folder / "result.json").read_text())
    Draft202012Validator(schema()).validate(out)
    return out


@pytest.fixture(scope="module")
def solved(folders: dict[str, Path]) -> dict[str, dict[str, Any]]:
    """The results of two sessions."""
    return {unit: solved_in(folders[unit]) for unit in ("SI", "count")}


@pytest.mark.thorough
@pytest.mark.parametrize(("unit", "acc", "gyr"), [("count", ACC, GYR), ("V", 0.2, 3.0)])
def test_what_is_solved_is_the_same_in_another_unit(
    solved: dict[str, dict[str, Any]],
    folders: dict[str, Path],
    unit: str,
    acc: float,
    gyr: float,
) -> None:
    plain = solved["SI"]["parameters"]
    scaled = (solved.get(unit) or solved_in(folders[unit]))["parameters"]
    assert plain.keys() == scaled.keys()
    for group, entry in plain.items():
        kind = {"acc": acc, "cro": acc, "gyr": gyr}
        c = kind.get(group[:3], 1.0)
        for key in ("value", "sigma"):
            mine, other = (np.array(e[key], float) for e in (entry, scaled[group]))
            np.testing.assert_allclose(other, c * mine, rtol=1e-5, atol=1e-6 * c)
    assert scaled["acc_bias"]["unit"] == unit
    assert scaled["acc_scale"]["unit"] == f"{unit}/(m/s^2)"
    assert scaled["gyr_bias"]["unit"] == unit


def test_effects_are_relative_and_the_calibration_is_in_counts(
    folders: dict[str, Path],
) -> None:
    assert main(["diagnose", str(folders["count"])]) == 1
    said = json.loads((folders["count"] / "diagnosis.json").read_text())
    (counted,) = said["effects"]
    assert counted["id"] == "cross_coupling"
    k12 = counted["parameters"]["k12"]
    # K2 and hysteresis of the accelerometers, which nobody knows, are in it
    assert abs(k12["value"] - parse(COUPLED)["k12"]) < 4 * k12["sigma"] < 3e-3
    bias = said["calibration"]["acc_bias"]
    assert bias["unit"] == "count"
    off = np.array(bias["value"]) - ACC * np.array(Profile().truth.acc_bias)
    assert (np.abs(off) < 4 * np.array(bias["sigma"])).all()
    assert (np.array(bias["sigma"]) < 0.01 * ACC).all()


@pytest.mark.thorough
@pytest.mark.usefixtures("solved")
def test_it_is_applied_exported_and_shown(
    folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = {}
    for name in ("SI", "count"):
        folder = str(folders[name])
        assert main(["apply", folder, str(tmp_path / f"{name}.csv")]) == 0
        out[name] = np.genfromtxt(tmp_path / f"{name}.csv", delimiter=",", names=True)
        assert main(["report", folder, "-o", str(tmp_path / f"{name}.html")]) == 0
    for channel in ("ax", "gz"):
        np.testing.assert_allclose(out["SI"][channel], out["count"][channel], atol=1e-6)
    page = (tmp_path / "count.html").read_text()
    assert "count/(m/s²)" in page
    capsys.readouterr()
    table = tmp_path / "c.csv"
    command = ["export", str(folders["count"]), "--format"]
    assert main([*command, "csv", "-o", str(table)]) == 0
    assert "acc_scale.x" in table.read_text() and "count/(m/s^2)" in table.read_text()
    assert main([*command, "imu_tk", "-o", str(tmp_path / "t")]) == 0
    assert f"the samples' count divided by {ACC:g}" in capsys.readouterr().err


def test_counts_that_nobody_said_the_worth_of(
    folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (folders["count"] / "session.toml").read_text()
    positions = text[text.index("[[position]]") :]
    (tmp_path / "session.toml").write_text(
        'format = 1\n[units]\nacceleration = "count"\nangular_rate = "count"\n'
        + positions
    )
    samples = folders["count"] / "samples.arrows"
    (tmp_path / "samples.arrows").write_bytes(samples.read_bytes())
    assert main(["solve", str(tmp_path)]) == 2
    assert (
        "[nominal] acc_scale (how many count in one m/s^2)" in capsys.readouterr().err
    )


@given(
    acc=st.floats(1e-6, 1e6),
    gyr=st.floats(1e-6, 1e6),
    units=st.sampled_from([("count", "count"), ("V", "rad/s"), ("m/s^2", "V")]),
)
def test_out_and_in_again(acc: float, gyr: float, units: tuple[str, str]) -> None:
    names = ("acc_bias.x", "gyr_scale.z", "base_tilt.about_x_deg", "cross_coupling.k12")
    made = Calibration(
        "joint",
        names,
        np.array([0.1, 1.02, -0.3, 0.004]),
        np.diag([1e-4, 1e-6, 1e-2, 1e-8]),
        ("m/s^2", "1", "deg", "1"),
        1.0,
        1,
        0.1,
        info={"gauge": Gauge((acc, gyr), units).table()},
    )
    again = in_si_units(in_sample_units(made))
    np.testing.assert_allclose(again.values, made.values, rtol=1e-12)
    np.testing.assert_allclose(again.covariance, made.covariance, rtol=1e-12)
    assert again.units == made.units
    assert in_sample_units(made).value("base_tilt.about_x_deg") == -0.3


@pytest.mark.parametrize(
    "table",
    [{}, {"size": [1.0], "units": ["V", "V"]}, {"size": [0, 1], "units": "VV"}, 3],
)
def test_a_gauge_that_is_none_is_refused(table: object) -> None:
    with pytest.raises(InputError, match="gauge is not two sizes"):
        Gauge.read(table)


def test_an_import_of_counts_asks_what_they_are_worth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    block = recorded(Profile(), places([(0.0, 0.0)], 20.0))
    rows = np.column_stack([block.t, np.round(block.six * np.repeat([ACC, GYR], 3))])
    log = tmp_path / "log.csv"
    np.savetxt(log, rows, delimiter=",")
    command = ["import", str(log), "--columns", "t,ax,ay,az,gx,gy,gz"]
    bare = ["--acc-unit", "count", "--gyr-unit", "count", "-o", str(tmp_path / "a")]
    assert main([*command, *bare]) == 0
    assert "nothing says what a count is worth" in capsys.readouterr().err
    worth = ["--acc-unit", "m/s^2", "--acc-lsb", str(ACC), "--gyr-unit", "rad/s"]
    worth += ["--gyr-lsb", str(GYR), "-o", str(tmp_path / "b")]
    assert main([*command, *worth]) == 0
    assert "1 still stretch" in capsys.readouterr().err
