"""Parameters over temperature, read back by a virtual autopilot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("fastcrc")
pytest.importorskip("pymavlink")

from processes import simulated
from pymavlink.dialects.v20 import all as dialect
from thermal_devices import Warming, drawn, exact, session

from fieldcal.calibration import limits
from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.drivers.mavlink_parameter_names import ARDUPILOT, PX4
from fieldcal.drivers.mavlink_parameters import ParameterLink
from fieldcal.install.thermal import id_names, thermal_parameters
from fieldcal.install.transaction import GYR_OFFSETS
from fieldcal.sim_device.autopilot import Autopilot
from fieldcal.thermal import ThermalModel, thermal_model, thermal_point

PROGRAMS = {"ardupilot": ARDUPILOT, "px4": PX4}
WARM = (2.0, 12.0, 21.0, 33.0, 41.0, 48.0)


def device(seed: int = 1) -> Warming:
    """A device whose scale factors stay what they are: autopilots take no others."""
    made = drawn(np.random.default_rng(seed))
    made.coefficients["acc_scale"][1:] = 0
    return made


def model(of: Warming) -> ThermalModel:
    covariance = exact(of) * 1e-4
    every = [
        thermal_point("s", session(of, t, np.zeros(len(covariance)), covariance))
        for t in WARM
    ]
    return thermal_model(every, limits.read("tactical"))


def sent(autopilot: Autopilot, block: Block) -> np.ndarray:
    """What it sends of a sensor's output, (n, 6), out of its HIGHRES_IMU packets."""
    reader = dialect.MAVLink(None)
    rows = []
    for packet in autopilot.samples(block, 100.0):
        for m in reader.parse_buffer(packet) or []:
            rows.append([m.xacc, m.yacc, m.zacc, m.xgyro, m.ygyro, m.zgyro])
    return np.array(rows)


@pytest.mark.parametrize("kind", PROGRAMS)
@pytest.mark.parametrize("instance", [0, 2])
def test_the_autopilot_takes_out_what_the_device_does(kind: str, instance: int) -> None:
    """At temperatures between the sessions, and held at the ends beyond them."""
    of = device()
    autopilot = Autopilot(f"autopilot={kind}&instance={instance}&streams=HIGHRES_IMU")
    ids = {name: autopilot.parameters.get(name, 0.0) for name in id_names(instance)}
    made = thermal_parameters(PROGRAMS[kind], model(of), instance, ids)
    assert set(made.values) <= set(autopilot.parameters)
    autopilot.parameters |= {
        n: float(np.float32(p.value)) for n, p in made.values.items()
    }
    force, rate = np.array([1.0, -9.8, 3.0]), np.array([0.1, -0.2, 0.3])
    for t in (2.0, 7.0, 25.0, 39.0, 48.0):
        true = of.values(t)
        acc = true["acc_bias"] + true["acc_scale"] * force
        gyr = true["gyr_bias"] + rate
        seq, three = np.arange(3.0), np.ones((3, 1))
        block = Block.of(seq / 100, three * acc, three * gyr, np.full(3, t), seq)
        out = sent(autopilot, block).mean(axis=0)
        np.testing.assert_allclose(out[:3], force, atol=2e-4)
        np.testing.assert_allclose(out[3:], rate, atol=5e-6)
    hot = Block.of(seq / 100, three * acc, three * gyr, np.full(3, 60.0), seq)
    np.testing.assert_allclose(sent(autopilot, hot), sent(autopilot, block), atol=1e-6)


def test_ardupilot_numbers_its_fourth_imu_before_the_sensor() -> None:
    """INS4_TCAL_ACC1_X and INS4_ACC_CALTEMP, as its list of parameters has them."""
    names = set(thermal_parameters(ARDUPILOT, model(device()), 3).values)
    assert {"INS4_TCAL_ENABLE", "INS4_TCAL_GYR3_Z", "INS4_GYR_CALTEMP"} <= names
    assert {"INS4_TCAL_ACC1_X", "INS4_ACC_CALTEMP", "INS4_ACCOFFS_X"} <= names
    assert all(name.startswith("INS4_") for name in names)
    assert {"INS5_GYROFFS_Y", "INS5_GYR_CALTEMP", "CAL_GYRO3_XOFF"} <= GYR_OFFSETS


@pytest.mark.thorough
def test_the_uncertainty_is_that_of_many_sessions_errors() -> None:
    of, rng = drawn(np.random.default_rng(2), "acc_bias"), np.random.default_rng(3)
    covariance, bounds = exact(of), limits.read("tactical")
    sigma = np.sqrt(np.diag(covariance))
    found = []
    for _ in range(20):
        errors = rng.normal(0, sigma, (len(WARM), len(sigma)))
        pairs = zip(WARM, errors, strict=True)
        every = [thermal_point("s", session(of, t, e, covariance)) for t, e in pairs]
        made = thermal_parameters(ARDUPILOT, thermal_model(every, bounds)).values
        found.append([made[f"INS_TCAL1_ACC1_{x}"] for x in "XYZ"])
    spread = np.std([[p.value for p in row] for row in found], axis=0)
    stated = np.sqrt(np.mean([[p.sigma**2 for p in row] for row in found], axis=0))
    assert np.all((spread / stated > 0.4) & (spread / stated < 1.4)), spread / stated


def test_what_has_no_place_is_said_with_what_it_costs() -> None:
    made = drawn(np.random.default_rng(4))
    made.coefficients["acc_scale"][1] = 2e-4
    made.coefficients["acc_scale"][2:] = 0
    says = thermal_parameters(PX4, model(made)).says
    assert any("acc_scale over temperature" in s and "0.045 m/s^2" in s for s in says)
    assert any("set TC_A0_ID to the value of CAL_ACC0_ID" in s for s in says)
    ids = {"CAL_ACC0_ID": 5.0, "CAL_GYRO0_ID": 6.0}
    made_with = thermal_parameters(PX4, model(made), ids=ids)
    assert not any("_ID" in s for s in made_with.says)
    assert made_with.values["TC_G0_ID"].value == 6.0


def folders(place: Path, of: Warming, go: bool = True) -> list[str]:
    """Solved sessions, a folder each."""
    rng, covariance = np.random.default_rng(5), exact(of)
    names = []
    for i, t in enumerate(WARM):
        error = rng.normal(0, np.sqrt(np.diag(covariance)))
        found = session(of, t, error, covariance)
        found.info["decision"]["go"] = go
        folder = place / f"s{i}"
        folder.mkdir()
        (folder / "session.toml").write_text("format = 1\n")
        (folder / "result.json").write_text(json.dumps(found.to_json()))
        names.append(str(folder))
    return names


@pytest.mark.parametrize(
    "kind", ["px4", pytest.param("ardupilot", marks=pytest.mark.thorough)]
)
def test_written_read_back_and_undone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str
) -> None:
    """Over a link: whole numbers of PX4 as whole numbers, and the sensor's number."""
    sessions = folders(tmp_path, device(3))
    with simulated("--mavlink", f"tcpin:127.0.0.1:0?autopilot={kind}") as (place, _):
        url = f"mavlink:{place}?system=1&component=1"
        call = ["temperature", *sessions, "--device", url, "--yes", "--json"]
        assert main(call) == 0
        said = capsys.readouterr()
        assert (
            "written and read back" in said.err and "restart the autopilot" in said.err
        )
        made = json.loads(said.out)
        low, high = made["range_degc"]
        with ParameterLink(url.removeprefix("mavlink:")) as link:
            head = "TC_A0" if kind == "px4" else "INS_TCAL1"
            kept = link.read([f"{head}_TMIN", f"{head}_TMAX"])
            assert [*kept.values()] == [low, high]
            if kind == "px4":
                ids = link.read(["TC_A0_ID", "CAL_ACC0_ID", "TC_G_ENABLE"])
                assert ids["TC_A0_ID"] == ids["CAL_ACC0_ID"] > 0 < ids["TC_G_ENABLE"]
        assert main(["undo", sessions[-1], "--yes"]) == 0
        with ParameterLink(url.removeprefix("mavlink:")) as link:
            enable = "TC_A_ENABLE" if kind == "px4" else "INS_TCAL1_ENABLE"
            assert link.read([enable]) == {enable: 0.0}


def test_no_go_sessions_are_not_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sessions = folders(tmp_path, device(3), go=False)
    call = ["temperature", *sessions, "--device", "mavlink:tcp:127.0.0.1:1", "--yes"]
    assert main(call) == 1
    assert "NO-GO, nothing is written" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "ending"), [("ardupilot", "param"), ("px4", "params")]
)
def test_a_file_has_what_the_autopilot_loads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, ending: str
) -> None:
    sessions = folders(tmp_path, device(3))
    path = tmp_path / f"x.{ending}"
    assert main(["temperature", *sessions, "--format", name, "-o", str(path)]) == 0
    lines = [x for x in path.read_text().splitlines() if not x.startswith("#")]
    known = Autopilot(f"autopilot={name}").parameters
    if name == "px4":
        rows = [line.split("\t") for line in lines]
        assert {r[2]: r[4] for r in rows}["TC_A_ENABLE"] == "6"
        assert {r[2] for r in rows} <= set(known)
    else:
        rows = [line.split(",") for line in lines]
        assert {r[0] for r in rows} <= set(known)
        assert dict(rows)["INS_TCAL1_ENABLE"] == "1"
    assert main(["temperature", *sessions, "--format", name, "-o", str(path)]) == 2
    assert "there already" in capsys.readouterr().err
