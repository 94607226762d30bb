"""Every real recording by one command, and what was found against its provenance."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from calibrations import calibration
from recordings import REAL

from fieldcal.cli import main
from fieldcal.session.folder import Session
from fieldcal.session.integrity import file_faults

PYULOG, STREAMS = "pyulog_samples", "autopilot_streams"
HAND, SUN = "tomisuarez_mpu6050", "sunsided_mpu6050_temp"
SIX = ["--columns", "ax,ay,az,gx,gy,gz", "--rate", "100"]
COUNTS = ["--acc-unit", "g", "--acc-lsb", "16384", "--gyr-unit", "deg/s"]
COUNTS += ["--gyr-lsb", "131"]
SETS = ["--join", "--columns", "t,ax,ay,az", "--columns", "t,gx,gy,gz"]
SETS += ["--columns", "t,temperature", "--acc-unit", "g", "--gyr-unit", "deg/s"]
PHONE = "t=accelerometer_t," + ",".join(
    f"{kind}{axis}={name}_value.{i}"
    for kind, name in (("a", "accelerometer"), ("g", "gyro"))
    for i, axis in enumerate("xyz")
)


class Found(NamedTuple):
    """What a stream must have; None where the provenance says nothing."""

    rows: int
    seconds: float
    rate: float
    degrees: tuple[float, float] | None = None
    gap: float = 0.0
    still: int | None = None


def parts(name: str) -> list[str]:
    return [
        f"{SUN}/{name}__{part}.mat"
        for part in ("accelerometer", "gyroscope", "temperature")
    ]


COMMANDS: dict[str, tuple[list[str], list[str], dict[str, Found]]] = {
    **{
        f"hand-held {n}": ([f"mikoff_mpu9150_x5/imu{n}.log.gz"], SIX, {
            "": Found(rows, rows / 100, 100)})
        for n, rows in enumerate((15969, 15931, 15934, 15967, 15968))
    },
    "annotated faces": (
        ["imucal_ferraris/annotated_session.csv.gz"],
        ["--columns", "_,_,ax,ay,az,gx,gy,gz", "--rate", "102.4", "--acc-unit", "g",
         "--acc-lsb", "2048", "--gyr-unit", "deg/s", "--gyr-lsb", "16.384"],
        {"": Found(9414, 91.9, 102.4)}),
    "example faces": (
        ["imucal_ferraris/example_ferraris_session.csv.gz"],
        ["--columns", "_,gx,gy,gz,ax,ay,az", "--rate", "102.4", "--gyr-unit", "deg/s"],
        {"": Found(10376, 101.3, 102.4)}),
    "calibration in counts": ([f"{HAND}/example_data_calibration.csv.gz"],
        SIX + COUNTS, {"": Found(10245, 102.4, 100)}),
    "static in counts": ([f"{HAND}/example_data_tinit_calc.csv.gz"], SIX + COUNTS, {
        "": Found(44930, 449.3, 100, still=1)}),
    "turns in counts": ([f"{HAND}/imu_90_x_rot.csv.gz"], SIX + COUNTS, {
        "": Found(9987, 99.9, 100)}),
    "short static in counts": ([f"{HAND}/imu_static_test.csv.gz"], SIX + COUNTS, {
        "": Found(9986, 99.8, 100, still=1)}),
    "PX4, combined": ([f"{PYULOG}/sample.ulg.gz"], [], {
        "": Found(17070, 68.9, 248, gap=0.065)}),
    "PX4, three sensors": ([f"{PYULOG}/sample_log_small.ulg.gz"], [], {
        "sensor_accel.0": Found(6, 5.0, 1, (40.0, 40.4)),
        "sensor_accel.1": Found(6, 5.0, 1, (28.2, 28.4)),
        "sensor_accel.2": Found(6, 5.0, 1, (29.4, 29.8)),
        "sensor_combined.0": Found(1298, 6.5, 200, gap=0.161)}),
    "PX4, appended": ([f"{PYULOG}/sample_appended_multiple.ulg.gz"], [], {
        "": Found(2373, 9.6, 247)}),
    "full sphere": (parts("set-2__full-sphere"), SETS, {
        "": Found(10528, 106.3, 99, (24.6, 25.1), 0.251)}),
    "ten minutes": (parts("set-2__unmoved-with-x-pointing-forward-10min"), SETS, {
        "": Found(65067, 655.1, 99.3, (25.0, 25.7), 0.497)}),
    "phone": (["comma_rav4_can/phone_imu.npz"], ["--columns", PHONE], {
        "": Found(6256, 60.0, 104)}),
    "ArduPilot, telemetry": ([f"{STREAMS}/autopilot_12_positions.tlog.gz"], [], {
        "HIGHRES_IMU.0": Found(16916, 338.3, 50, still=12),  # a barometer
        "RAW_IMU.0": Found(16917, 338.3, 50, (24.9, 25.7), still=12)}),
    "VectorNav": ([f"{STREAMS}/vectornav.bin.gz"], [], {
        "": Found(343, 7.1, 48, (11.2, 11.3))}),
    "MicroStrain": ([f"{STREAMS}/microstrain_mip.bin.gz"], ["--rate", "25"], {
        "": Found(178, 7.1, 25)}),
}  # fmt: skip


DISTINCT = frozenset(
    [
        "annotated faces",
        "short static in counts",
        "PX4, three sensors",
        "PX4, appended",
        "full sphere",
        "phone",
        "ArduPilot, telemetry",
        "VectorNav",
        "MicroStrain",
    ]
)
"""Each of another format, or with something that no other has."""


def files(names: list[str]) -> list[str]:
    paths = [REAL / name for name in names]
    if absent := [path for path in paths if not path.is_file()]:
        pytest.skip(f"the recording is not here: {absent[0]}")
    return [str(path) for path in paths]


def mark(folder: Path, event: str) -> dict[str, Any]:
    return next(m for m in Session.open(folder).marks() if m["event"] == event)


def imported(folder: Path) -> dict[str, Any]:
    return mark(folder, "imported")


@pytest.mark.parametrize(
    "name",
    [
        name if name in DISTINCT else pytest.param(name, marks=pytest.mark.thorough)
        for name in COMMANDS
    ],
)
def test_a_recording_is_brought_in_as_its_provenance_says(
    name: str, tmp_path: Path
) -> None:
    names, options, expected = COMMANDS[name]
    assert main(["import", *files(names), *options, "-o", str(tmp_path / "s")]) == 0
    if "" not in expected:
        assert {p.name for p in (tmp_path / "s").iterdir()} == set(expected)
    for stream, found in expected.items():
        folder = tmp_path / "s" / stream
        assert not list(file_faults(folder))
        facts = imported(folder)
        assert facts["rows"] == found.rows == len(Session.open(folder).block)
        assert facts["end_s"] - facts["start_s"] == pytest.approx(
            found.seconds, abs=0.1
        )
        assert facts["rate_hz"] == pytest.approx(found.rate, rel=0.01)
        assert facts["longest_gap_s"] == pytest.approx(found.gap, abs=0.001)
        if found.degrees:
            low, high = found.degrees
            assert low <= facts["coldest"] <= facts["warmest"] <= high
        if found.still is not None:
            assert len(Session.open(folder).windows) == found.still
        assert facts["left_out"] == 0 and facts["repairs"] == []
        assert [f["name"] for f in facts["files"]] == [Path(n).name for n in names]


def test_a_car_s_bus_is_read_by_its_dbc(tmp_path: Path) -> None:
    (log,) = files(["comma_rav4_can/rav4_bus0_2018-08-02_seg40.candump.log.gz"])
    (dbc,) = files(["comma_rav4_can/rav4_kinematics_extract.dbc"])
    options = f"dbc={dbc}&map=ax=ACCELEROMETER.ACCEL_X"
    assert main(["import", log, "--options", options, "-o", str(tmp_path / "s")]) == 0
    facts = imported(tmp_path / "s")
    assert facts["end_s"] - facts["start_s"] == pytest.approx(60, abs=0.5)
    block = Session.open(tmp_path / "s").block
    assert np.abs(block.acc[:, 0]).max() < 20 and np.isnan(block.acc[:, 1:]).all()


def test_rows_never_filled_are_refused_or_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = parts("set-1__unmoved-z-pointing-left")
    call = ["import", *files(names), *SETS, "-o", str(tmp_path / "s")]
    assert main(call) == 2
    said = capsys.readouterr().err
    assert "accelerometer.mat: row 6281 to row 7000, column t ax ay az" in said
    assert "hold only zeros" in said and "--repair" in said
    assert not (tmp_path / "s").exists()
    assert main([*call, "--repair"]) == 0
    facts = imported(tmp_path / "s")
    assert (facts["rows"], facts["left_out"]) == (6280, 720)
    assert "row 6281 to row 7000" in facts["repairs"][0]
    assert "left out: 720 rows" in capsys.readouterr().err


def test_what_px4_had_installed_comes_along(tmp_path: Path) -> None:
    (path,) = files([f"{PYULOG}/sample_log_small.ulg.gz"])
    assert main(["import", path, "-o", str(tmp_path / "s")]) == 0
    both = ("sensor_accel.2", "sensor_combined.0")
    device = {n: mark(tmp_path / "s" / n, "device") for n in both}
    raw, combined = (device[n] for n in both)
    assert raw["device_id"] == 2621474 and raw["installed"]["instance"] == 2
    assert raw["installed"]["taken_out"] and not combined["installed"]["taken_out"]
    found = raw["installed"]["parameters"]["CAL_ACC2_XOFF"]
    assert found == pytest.approx(0.1319823)
    assert combined["installed"]["instance"] == 0
    assert combined["installed"]["parameters"]["SENS_BOARD_ROT"] == 4


def test_a_raw_px4_recording_is_installed_into_its_own_slot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (path,) = files([f"{PYULOG}/sample_log_small.ulg.gz"])
    assert main(["import", path, "-o", str(tmp_path / "s")]) == 0
    folder = tmp_path / "s" / "sensor_accel.2"
    cal = calibration(np.random.default_rng(1), 0.0)
    (folder / "result.json").write_text(json.dumps(cal.to_json()))
    out = tmp_path / "out.params"
    assert main(["export", str(folder), "--format", "px4", "-o", str(out)]) == 0
    rows = [line.split("\t") for line in out.read_text().splitlines() if "\t" in line]
    values = {row[2]: float(row[3]) for row in rows}
    assert values["CAL_ACC2_XOFF"] == pytest.approx(cal.value("acc_bias.x"))
    assert values["CAL_ACC2_YSCALE"] == pytest.approx(1 / cal.value("acc_scale.y"))
    turned = tmp_path / "s" / "sensor_combined.0"
    (turned / "result.json").write_text(json.dumps(cal.to_json()))
    capsys.readouterr()
    out = tmp_path / "turned.params"
    assert main(["export", str(turned), "--format", "px4", "-o", str(out)]) == 2
    assert "SENS_BOARD_ROT = 4" in capsys.readouterr().err
