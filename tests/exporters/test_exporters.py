"""Exported numbers, used as each program uses them, against fieldcal's own `apply`."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import Any

import jsonschema
import numpy as np
import pytest
import yaml
from calibrations import calibration

from fieldcal.calibration import Calibration, Nominal
from fieldcal.cli import main
from fieldcal.core.errors import InputError, SessionError
from fieldcal.core.samples import Array, Block
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import ARDUPILOT, PX4, parameter_names
from fieldcal.exporters import ExportSource, ardupilot, format_names, load_exporter, px4
from fieldcal.exporters.kalibr import window_noise_density
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder
from fieldcal.session.sample_files import find_samples
from fieldcal.session.schemas import load_schema


def samples(rng: np.random.Generator, n: int = 200) -> Block:
    return Block.of(
        np.arange(n) / 100, rng.normal(0, 9, (n, 3)), rng.normal(0, 1, (n, 3))
    )


def corrected(
    values: dict[str, float], autopilot: int, instance: int, raw: Block
) -> tuple[Array, Array]:
    """(raw - offset) * scale, as both autopilots do it."""
    known = parameter_names(autopilot, instance)
    offset, scale, gyro = (
        np.array([values[n] for n in known[what]])
        for what in ("acc_offset", "acc_scale", "gyr_offset")
    )
    return (raw.acc - offset) * scale, raw.gyr - gyro


@pytest.mark.parametrize(("module", "number"), [(ardupilot, ARDUPILOT), (px4, PX4)])
@pytest.mark.parametrize("instance", [0, 2])
def test_an_autopilot_corrects_raw_samples_as_apply_does(
    module: ModuleType, number: int, instance: int
) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        cal, raw = calibration(rng, 0.0), samples(rng)
        found = module.parameters(cal, instance=instance)
        acc, gyr = corrected(dict(found.values), number, instance, raw)
        np.testing.assert_allclose(acc, cal.apply(raw).acc, atol=1e-12)
        np.testing.assert_allclose(gyr, cal.apply(raw).gyr, atol=1e-12)
        assert not found.notices


def test_what_ardupilot_would_not_take_for_a_calibration_is_said() -> None:
    """Outside of its list's range; and 0, 0, 0, with which it does not arm."""
    cal = calibration(np.random.default_rng(1), 0.0)
    wide = replace(cal, values=np.where([n == "acc_bias.y" for n in cal.names], 4.0,
                                        cal.values))  # fmt: skip
    (said,) = ardupilot.parameters(wide).notices
    assert said.startswith("INS_ACCOFFS_Y = 4 is outside of the range")
    scales = without(cal, *(f"acc_bias.{axis}" for axis in "xyz"))
    assert any("does not arm" in s for s in ardupilot.parameters(scales).notices)
    assert not any("not arm" in s for s in px4.parameters(scales).notices)


def test_px4_has_four_sensors_and_ardupilot_five() -> None:
    cal = calibration(np.random.default_rng(1), 0.0)
    assert px4.parameters(cal, instance=3) and ardupilot.parameters(cal, instance=4)
    with pytest.raises(InputError, match="no sensor 4: its last one is 3"):
        px4.parameters(cal, instance=4)


def test_what_the_programs_do_with_a_file_is_said(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    """ArduPilot averages its gyroscopes at each start; PX4 goes by the sensors' ids."""
    says = load_exporter("ardupilot").write(made[0], tmp_path / "a.param")
    assert any("unless INS_GYR_CAL = 0" in s and "INS_GYROFFS_X" in s for s in says)
    says = load_exporter("px4").write(made[0], tmp_path / "p.params")
    assert any("CAL_ACC0_ID and CAL_GYRO0_ID" in s for s in says)


def test_ardupilot_numbers_its_fourth_imu_before_the_sensor() -> None:
    """INS4_ACCOFFS_X, as its list of parameters has it, beside INS_ACC3OFFS_X."""
    cal = calibration(np.random.default_rng(1), 0.0)
    for instance, heads in (
        (2, ("INS_ACC3", "INS_GYR3")),
        (4, ("INS5_ACC", "INS5_GYR")),
    ):
        acc, gyr = heads
        made = [f"{acc}OFFS_", f"{acc}SCAL_", f"{gyr}OFFS_"]
        names = list(ardupilot.parameters(cal, instance=instance).values)
        assert names == [f"{head}{axis}" for head in made for axis in "XYZ"]


@pytest.mark.parametrize(("module", "number"), [(ardupilot, ARDUPILOT), (px4, PX4)])
@pytest.mark.parametrize("taken_out", [False, True])
def test_what_was_installed_is_put_together_with_what_was_found(
    module: ModuleType, number: int, taken_out: bool
) -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        known = parameter_names(number, 1)
        device = InstalledCalibration(
            number, 1, dict.fromkeys(known["rotation"], 0.0), taken_out
        )
        for what, centre, width in (
            ("acc_offset", 0, 0.4),
            ("acc_scale", 1, 0.03),
            ("gyr_offset", 0, 0.02),
        ):
            device.values |= {n: float(rng.normal(centre, width)) for n in known[what]}
        raw, cal = samples(rng), calibration(rng, 0.0)
        acc, gyr = corrected(device.values, number, 1, raw)
        sent = raw if taken_out else Block.of(raw.t, acc, gyr)
        new = module.parameters(
            cal, installed=InstalledCalibration.from_table(device.as_table())
        ).values
        acc, gyr = corrected(dict(new), number, 1, raw)
        np.testing.assert_allclose(acc, cal.apply(sent).acc, atol=1e-12)
        np.testing.assert_allclose(gyr, cal.apply(sent).gyr, atol=1e-12)


def without(cal: Calibration, *names: str) -> Calibration:
    """The calibration as if some parameters had not been determined."""
    keep = [i for i, n in enumerate(cal.names) if n not in names]
    return replace(
        cal,
        names=tuple(cal.names[i] for i in keep),
        values=cal.values[keep],
        covariance=cal.covariance[np.ix_(keep, keep)],
        units=tuple(cal.units[i] for i in keep),
    )


@pytest.mark.parametrize(("module", "number"), [(ardupilot, ARDUPILOT), (px4, PX4)])
@pytest.mark.parametrize("taken_out", [False, True])
def test_an_axis_that_was_not_determined_keeps_what_was_installed_and_is_said(
    module: ModuleType, number: int, taken_out: bool
) -> None:
    known = parameter_names(number, 0)
    device = InstalledCalibration(
        number, 0, dict.fromkeys(known["rotation"], 0.0), taken_out
    )
    for what, value in (("acc_offset", 0.3), ("acc_scale", 1.02), ("gyr_offset", 0.01)):
        device.values |= dict.fromkeys(known[what], value)
    cal = calibration(np.random.default_rng(8), 0.0)
    few = without(cal, "acc_scale.z", "acc_bias.x", "gyr_bias.y")
    found = module.parameters(few, installed=device)
    scale, gyro = known["acc_scale"][2], known["gyr_offset"][1]
    assert found.values[scale] == pytest.approx(1.02)
    assert found.values[gyro] == pytest.approx(0.01)
    assert found.values[known["acc_offset"][0]] == pytest.approx(0.3)
    for said in ("acc_scale z", "acc_bias x", "gyr_bias y"):
        assert any(s.startswith(f"{said} was not deter") for s in found.notices)
    # nothing is known to be installed: the nominal one, and that is said as well
    alone = module.parameters(few)
    assert alone.values[scale] == 1.0 and alone.values[gyro] == 0.0
    assert "gyr_bias y was not determined: the nominal one is used" in alone.notices


def test_what_an_autopilot_has_no_place_for_is_said_with_its_size() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        cal = calibration(rng, 0.003, 0.01)
        raw = samples(rng)
        found = ardupilot.parameters(cal)
        acc, _ = corrected(dict(found.values), ARDUPILOT, 0, raw)
        true = cal.apply(raw).acc
        error = np.abs(acc - true).max(axis=1) / np.linalg.norm(true, axis=1)
        (said,) = [s for s in found.notices if s.startswith("cross_coupling")]
        bound = float(said.split(" m/s^2")[0].rpartition(" ")[2]) / 9.80665
        assert error.max() <= bound * 1.01
        assert error.max() > 0.3 * bound
        assert any(s.startswith("gyr_scale") for s in found.notices)


def test_parameters_of_another_program_or_a_turned_board_are_refused() -> None:
    rng = np.random.default_rng(4)
    cal = calibration(rng, 0.0)
    with pytest.raises(InputError, match="another autopilot"):
        ardupilot.parameters(cal, installed=InstalledCalibration(PX4, 0))
    turned = InstalledCalibration(
        PX4, 0, {n: 1.0 for some in parameter_names(PX4, 0).values() for n in some}
    )
    with pytest.raises(InputError, match="SENS_BOARD_ROT"):
        px4.parameters(cal, installed=turned)
    with pytest.raises(InputError, match="in full"):
        InstalledCalibration.from_table({"parameters": 3})


def source(folder: Path, cal: Calibration, raw: Block) -> ExportSource:
    about = {"format": 1, "device": {"name": "bench", "serial": "A1"}}
    end = float(raw.t[-1])
    about["position"] = [{"start_s": 0.0, "end_s": end}]
    with Recorder(folder, about) as recorder:
        recorder.append(raw)
    (folder / "result.json").write_text(json.dumps(cal.to_json()))
    return ExportSource(cal, Nominal(), Session.open(folder))


@pytest.fixture
def made(tmp_path: Path) -> tuple[ExportSource, Block, Block]:
    """A full calibration, raw samples, and what `apply` makes of them."""
    rng = np.random.default_rng(5)
    cal, raw = calibration(rng, 0.004, 0.01), samples(rng, 2000)
    raw = replace(raw, temperature=np.linspace(20, 21, len(raw)))
    return source(tmp_path / "s", cal, raw), raw, cal.apply(raw)


def written(made: ExportSource, name: str, folder: Path) -> Path:
    module = load_exporter(name)
    path = folder / f"out{module.ENDING}"
    module.write(made, path)
    return path


def test_an_ardupilot_file_is_read_by_pymavlink(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    from pymavlink.mavparm import MAVParmDict

    path = written(made[0], "ardupilot", tmp_path)
    table = MAVParmDict()
    assert table.load(str(path))
    expected = ardupilot.parameters(made[0].calibration).values
    assert {k: table[k] for k in expected} == pytest.approx(expected, rel=1e-7)
    assert set(table.keys()) == set(expected)


def test_a_px4_file_has_a_parameter_a_line(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    lines = written(made[0], "px4", tmp_path).read_text().splitlines()
    rows = [line.split("\t") for line in lines if not line.startswith("#")]
    expected = px4.parameters(made[0].calibration).values
    assert {r[2]: float(r[3]) for r in rows} == pytest.approx(expected, rel=1e-7)
    assert {(r[0], r[1], r[4]) for r in rows} == {("1", "1", "9")}


def test_imu_tk_corrects_by_t_k_u_minus_b(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    path = written(made[0], "imu_tk", tmp_path)
    gyro = path.with_name(path.name.replace("_acc", "_gyro"))
    _, raw, true = made
    for file, u, f in ((path, raw.acc, true.acc), (gyro, raw.gyr, true.gyr)):
        numbers = np.array(file.read_text().split(), dtype=float)
        t, k, b = numbers[:9].reshape(3, 3), numbers[9:18].reshape(3, 3), numbers[18:]
        np.testing.assert_allclose((u - b) @ (t @ k).T, f, atol=1e-9)
        np.testing.assert_array_equal(np.diag(t).round(12), 1)
        np.testing.assert_array_equal(k, np.diag(np.diag(k)))
        # the paper's sign: a = T K (a_S + b)
        np.testing.assert_allclose((u + -b) @ (t @ k).T, f, atol=1e-9)


@pytest.mark.parametrize("stem", ["my_accident", "my_accident_acc", "other"])
def test_imu_tk_names_both_files_and_overwrites_neither(
    stem: str, made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    second = tmp_path / f"{stem.removesuffix('_acc')}_gyro.calib"
    second.write_text("somebody's")
    module, first = load_exporter("imu_tk"), tmp_path / f"{stem}.calib"
    with pytest.raises(InputError, match="is there already"):
        module.write(made[0], first)
    assert second.read_text() == "somebody's" and not first.exists()
    second.unlink()
    module.write(made[0], first)
    assert {p.name for p in (first, second) if p.exists()} == {first.name, second.name}


@pytest.mark.parametrize("number", ["-1", "x", "1.5"])
def test_sensors_are_counted_from_0(
    number: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = ["export", str(tmp_path), "--format", "px4", f"--instance={number}"]
    assert main(call) == 2
    assert "is no number from 0 to 4" in capsys.readouterr().err


def test_kalibr_predicts_what_was_recorded(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    told = yaml.safe_load(written(made[0], "kalibr", tmp_path).read_text())
    _, raw, true = made
    acc, gyr = told["accelerometers"], told["gyroscopes"]
    m_acc, m_gyr, turn = (np.array(x) for x in (acc["M"], gyr["M"], gyr["C_gyro_i"]))
    np.testing.assert_allclose(true.acc @ m_acc.T + acc["bias"], raw.acc, atol=1e-9)
    predicted = true.gyr @ (m_gyr @ turn).T + gyr["bias"]
    np.testing.assert_allclose(predicted, raw.gyr, atol=1e-9)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-11)
    assert np.linalg.det(turn) > 0 and np.all(m_gyr == np.tril(m_gyr).round(15))
    # white noise of sd 9 m/s^2 and 1 rad/s at 100 Hz; the largest of three axes
    assert told["accelerometer_noise_density"] == pytest.approx(0.9, rel=0.5)
    assert told["gyroscope_noise_density"] == pytest.approx(0.1, rel=0.5)
    assert "accelerometer_random_walk" not in told


@pytest.mark.statistical
def test_a_density_of_windows_has_the_error_that_is_told(tmp_path: Path) -> None:
    """Scatter of 90 windows of white noise, 12 s each, in stated errors."""
    rng, pulls = np.random.default_rng(5), []
    for number in range(15):
        folder, n = tmp_path / str(number), 1200
        values = rng.normal(0, 0.3, (n, 6))
        tables = {"format": 1, "device": {"name": "t"}, "position": [{}]}
        with Recorder(folder, tables) as recorder:
            recorder.append(Block.of(np.arange(n) / 100, values[:, :3], values[:, 3:]))
            recorder.mark("window", position=0, start_s=0.0, end_s=12.0)
        density, error = window_noise_density(Session.open(folder))
        pulls += ((density - 0.03) / error).tolist()
    assert abs(np.mean(pulls)) < 0.5 and 0.7 < np.std(pulls) < 1.3


def test_imu_calib_corrects_by_sm_u_minus_bias(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    told = yaml.safe_load(written(made[0], "ros", tmp_path).read_text())
    _, raw, true = made
    for prefix, u, f in (("", raw.acc, true.acc), ("gyro_", raw.gyr, true.gyr)):
        sm = np.array(told[f"{prefix}SM"]).reshape(3, 3)
        np.testing.assert_allclose(u @ sm.T - told[f"{prefix}bias"], f, atol=1e-9)


def test_json_follows_its_schema_and_corrects(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    told = json.loads(written(made[0], "json", tmp_path).read_text())
    jsonschema.validate(told, load_schema("export"))
    _, raw, true = made
    for name, u, f in (
        ("accelerometer", raw.acc, true.acc),
        ("gyroscope", raw.gyr, true.gyr),
    ):
        found = (u - told[name]["bias"]) @ np.array(told[name]["matrix"]).T
        np.testing.assert_allclose(found, f, atol=1e-9)
    assert told["nominal"] == []


def test_the_table_has_every_parameter(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    cal = made[0].calibration
    with written(made[0], "csv", tmp_path).open() as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == list(cal.names)
    np.testing.assert_allclose([float(r["value"]) for r in rows], cal.values)
    np.testing.assert_allclose([float(r["sigma"]) for r in rows], cal.sigma)


def test_mcap_is_read_by_ros_and_by_ourselves(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    path = written(made[0], "mcap", tmp_path)
    _, raw, true = made
    for topic, expected in (("/imu/raw", raw), ("/imu/calibrated", true)):
        folder = tmp_path / topic.replace("/", "_")
        assert main(["import", str(path), "--instance", topic, "-o", str(folder)]) == 0
        back = Session.open(folder).block
        np.testing.assert_array_equal(back.acc, expected.acc)
        np.testing.assert_array_equal(back.gyr, expected.gyr)
        np.testing.assert_allclose(back.t, expected.t, atol=1e-9)
        np.testing.assert_array_equal(back.temperature, raw.temperature)
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        found = [
            m for *_, m in reader.iter_decoded_messages(topics=["/imu/calibrated"])
        ]
    f: Any = found[7].linear_acceleration
    np.testing.assert_array_equal([f.x, f.y, f.z], true.acc[7])
    assert found[7].orientation_covariance[0] == -1


def test_mcap_refuses_times_beyond_its_stamps(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    raw = samples(rng, 20)
    cal = calibration(rng, 0.004, 0.01)
    for first, fits in ((2.0**31 - 10.0, True), (2.0**31 - 0.1, False)):
        late = replace(raw, t=raw.t - raw.t[0] + first)
        folder = tmp_path / str(fits)
        made = source(folder / "s", cal, late)
        if fits:
            assert written(made, "mcap", folder).exists()
            continue
        with pytest.raises(InputError, match=r"a stamp of ROS ends at 2.15e\+09 s"):
            written(made, "mcap", folder)
        assert [p.name for p in folder.iterdir()] == ["s"]


def test_what_was_not_determined_is_said_not_filled_in_silence(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    whole = made[0].calibration
    keep = [i for i, n in enumerate(whole.names) if n.startswith("acc_bias")]
    few = replace(
        whole,
        names=tuple(whole.names[i] for i in keep),
        values=whole.values[keep],
        covariance=whole.covariance[np.ix_(keep, keep)],
        units=tuple(whole.units[i] for i in keep),
    )
    some = replace(made[0], calibration=few)
    for name in ("imu_tk", "kalibr", "ros", "json"):
        says = load_exporter(name).write(some, tmp_path / name)
        assert any("gyr_scale.y" in sentence for sentence in says)
        for triad in ("accelerometers", "gyroscopes"):
            said = f"cross-coupling of the {triad} was not determined"
            assert any(said in sentence for sentence in says)
            whole_says = load_exporter(name).write(made[0], tmp_path / f"whole {name}")
            assert not any(said in sentence for sentence in whole_says)
            for old in tmp_path.glob("whole*"):
                old.unlink()
        text = (tmp_path / name).read_text()
        if name in ("kalibr", "ros"):
            assert "# gyro_cross_coupling was not determined: 0\n" in text
    assert json.loads((tmp_path / "json").read_text())["zero"] == [
        "cross_coupling",
        "gyro_cross_coupling",
    ]
    says = load_exporter("ardupilot").write(some, tmp_path / "a.param")
    assert "gyr_bias was not determined: not written" in says
    assert "GYR" not in (tmp_path / "a.param").read_text().partition("INS_")[2]


@pytest.mark.parametrize(
    ("good", "decision", "expected"),
    [
        (True, {"go": True, "reasons": []}, None),
        (True, None, None),
        (True, {"go": False, "reasons": ["it was too warm"]}, "NO-GO: it was too warm"),
        (False, None, "NO-GO: the calibration is bad: two axes are swapped"),
        (False, {"go": True, "reasons": []}, "NO-GO: the calibration is bad: two axes"),
    ],
)
def test_what_is_not_to_be_used_is_not_handed_on_in_silence(
    good: bool,
    decision: dict[str, Any] | None,
    expected: str | None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    rng = np.random.default_rng(9)
    info = {"decision": decision} if decision else {}
    warnings = () if good else ("two axes are swapped",)
    cal = replace(calibration(rng, 0.0), good=good, info=info, warnings=warnings)
    source(tmp_path / "s", cal, samples(rng))
    place, out = str(tmp_path / "s"), str(tmp_path / "out.csv")
    for call in (["export", place, "--format", "csv", "-o", f"{out}.csv"],
                 ["apply", place, out]):  # fmt: skip
        assert main(call) == 0
        said = capsys.readouterr().err
        assert expected in said if expected else "NO-GO" not in said


def test_apply_says_of_which_axes_the_nominal_values_are_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(9)
    cal, raw = calibration(rng, 0.0), samples(rng)
    source(tmp_path / "s", without(cal, "acc_scale.z", "gyr_bias.y"), raw)
    out = tmp_path / "out.csv"
    assert main(["apply", str(tmp_path / "s"), str(out)]) == 0
    said = "nominal value is taken: acc_scale.z, gyr_bias.y, gyr_scale\n"
    assert capsys.readouterr().err.endswith(said)
    blind = replace(raw, gyr=np.full((len(raw), 3), np.nan))
    few = without(cal, *(n for n in cal.names if n.startswith("gyr")))
    source(tmp_path / "blind", few, blind)
    assert main(["apply", str(tmp_path / "blind"), str(out)]) == 0
    assert "nominal" not in capsys.readouterr().err


def test_samples_that_were_cut_off_are_said_by_what_writes_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(9)
    source(tmp_path / "s", calibration(rng, 0.0), samples(rng))
    with Recorder(tmp_path / "s", None) as recorder:
        recorder.append(samples(rng))
    file = find_samples(tmp_path / "s")
    data = file.read_bytes()
    file.write_bytes(data[: len(data) * 3 // 4])
    assert main(["apply", str(tmp_path / "s"), str(tmp_path / "out.csv")]) == 0
    assert "was cut off" in capsys.readouterr().err
    call = ["export", str(tmp_path / "s"), "-o", str(tmp_path / "out")]
    assert main([*call, "--format", "mcap"]) == 0
    assert "was cut off" in capsys.readouterr().err


def test_a_sensor_that_was_not_recorded_is_said_as_it_is(tmp_path: Path) -> None:
    """Neither parameters that are not written nor windows are what is wrong."""
    rng = np.random.default_rng(6)
    whole, raw = calibration(rng, 0.0), samples(rng, 2000)
    for sensor, name in (("acc", "accelerometer"), ("gyr", "gyroscope")):
        blind = replace(raw, **{sensor: np.full((len(raw), 3), np.nan)})
        few = without(whole, *(n for n in whole.names if n.startswith(sensor)))
        some = source(tmp_path / sensor, few, blind)
        path = written(some, "ardupilot", tmp_path / sensor)
        assert sensor.upper() not in path.read_text().partition("INS_")[2]
        says = load_exporter("px4").write(some, tmp_path / sensor / "p.params")
        assert f"{sensor}_bias was not determined: not written" in says
        assert not any("nominal one is used" in s for s in says)
        says = load_exporter("kalibr").write(some, tmp_path / sensor / "k.yaml")
        assert (
            f"{name}_noise_density was not determined: the session has no {name}s"
            in says
        )


@pytest.mark.parametrize("name", format_names())
def test_the_command_writes_every_format_and_overwrites_none(
    name: str,
    made: tuple[ExportSource, Block, Block],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    module = load_exporter(name)
    assert "raw" in (module.__doc__ or "") and module.WHAT
    call = ["export", str(tmp_path / "s"), "--format", name, "-o", str(tmp_path / "o")]
    assert main(call) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'o'}\n"
    before = (tmp_path / "o").read_bytes()
    assert main(call) == 2
    assert "is there already" in capsys.readouterr().err
    assert (tmp_path / "o").read_bytes() == before


def test_noise_that_was_measured_at_rest_goes_to_kalibr_and_ros(
    made: tuple[ExportSource, Block, Block], tmp_path: Path
) -> None:
    source = made[0]
    four = {
        f"{n}_{what}": {"value": 1e-5 * i, "sigma": None, "unit": "1"}
        for i, (n, what) in enumerate(
            product(("accelerometer", "gyroscope"), ("noise_density", "random_walk")), 1
        )
    }
    variance = {"value": 4e-6, "sigma": 1e-8, "unit": "m^2/s^4"}
    content = {
        **{"format": 1, "sessions": [], "device": {}, "seconds": 1.0, "longest_s": 1.0},
        **{"stretches": 1, "rate_hz": 1.0, "disturbed_share": 0.0, "channels": {}},
        "recalibrate": {"since": "", "channels": {}},
        "for": {
            "kalibr": four,
            "ros": {"linear_acceleration_covariance[4]": variance},
            "ardupilot": {},
            "px4": {},
        },
    }
    file = source.session.folder / "noise.json"
    file.write_text(json.dumps(content))
    try:
        told = yaml.safe_load(written(source, "kalibr", tmp_path).read_text())
        assert [told[n] for n in four] == pytest.approx([1e-5, 2e-5, 3e-5, 4e-5])
        told = yaml.safe_load(written(source, "ros", tmp_path).read_text())
        assert told["linear_acceleration_covariance"] == [0, 0, 0, 0, 4e-6, 0, 0, 0, 0]
        file.write_text("{")
        with pytest.raises(SessionError, match="run fieldcal noise again"):
            written(source, "kalibr", tmp_path)
    finally:
        file.unlink()
