"""An autopilot that starts anew and averages its gyroscopes, as ArduPilot does."""

import json
import socket
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest
import tomlkit

pytest.importorskip("fastcrc")
pytest.importorskip("pymavlink")

from processes import HANGS, TWO_POSITION, simulated, steady

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import ARDUPILOT, parameter_names
from fieldcal.drivers.mavlink_parameters import ParameterLink
from fieldcal.drivers.mavlink_watch import STABLE_ROUNDS, InstalledWatch
from fieldcal.session.installed_calibration import (
    NO_CORRECTION,
    nominal_as_sent,
    under_last_calibration,
)
from fieldcal.session.marks import read_marks

HOME, TURNED = {"alpha_deg": 0, "beta_deg": 0}, {"alpha_deg": 45, "beta_deg": 5}
VERIFIED = {"alpha_deg": 0, "beta_deg": 5}


def order(control: str, **request: Any) -> None:
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(control)
        line.sendall(json.dumps(request).encode() + b"\n")
        assert b"error" not in line.recv(4096)


def events(folder: Path, event: str) -> list[dict[str, Any]]:
    marks = read_marks(folder / "marks.jsonl")
    return [mark for mark in marks if mark["event"] == event]


def wait(run: subprocess.Popen[str], reached: Callable[[], bool]) -> None:
    deadline = monotonic() + HANGS
    while not reached():
        assert run.poll() is None and monotonic() < deadline
        sleep(0.02)


@pytest.fixture(scope="module")
def restarted(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[Path, str, str, dict[str, Any]]]:
    """A run across two starts of its autopilot; the latter while a window is taken.

    After a restart all biases may be other ones, so that the first position is taken
    once more. No turn was recorded across it: a position that is not fitted bears
    witness. The session, the autopilot's address, its control socket, and what it
    conceals.
    """
    folder = tmp_path_factory.mktemp("restarted")
    session, truth, plan = folder / "s", folder / "truth.json", folder / "plan.toml"
    again = {"position": [HOME, TURNED, HOME], "run": {"procedure": "positions"}}
    plan.write_text(tomlkit.dumps(again))
    sim = ["--mavlink", "tcpin:127.0.0.1:0?INS_ACCOFFS_X=0.5", "--speed", "20"]
    sim += ["--rate", "100", "--gravity=9.81", "--truth", str(truth)]
    sim += steady(folder)
    with simulated(*sim) as (place, control):
        url = f"mavlink:{place}"
        run = [str(plan) if word == "two_position" else word for word in TWO_POSITION]
        run += ["--gravity=9.81", "--seconds", "20", "--json"]
        run += ["--verify", "-o", str(session)]
        with subprocess.Popen(
            [*run, "--device", f"{url}?rate=100"], stdout=subprocess.PIPE, text=True
        ) as process:
            wait(process, lambda: len(events(session, "window")) == 1)
            order(control, fault={"reboot_s": 3.0})
            order(control, turn=TURNED)
            wait(process, lambda: len(events(session, "asked")) == 2)
            order(control, fault={"reboot_s": 3.0})
            wait(process, lambda: len(events(session, "window")) == 2)
            order(control, turn=HOME)
            wait(process, lambda: len(events(session, "window")) == 3)
            order(control, turn=VERIFIED)
            printed, _ = process.communicate()
        assert process.returncode == 0, json.loads(printed)["decision"]["reasons"]
        conceals = json.loads(truth.read_text())
        yield session, url, control, {**conceals, "result": json.loads(printed)}


def test_what_it_averaged_when_it_started_is_composed_with(
    restarted: tuple[Path, str, str, dict[str, Any]],
) -> None:
    session, _, _, conceals = restarted
    assert events(session, "link") and len(events(session, "device")) > 1
    # it averaged while it was turned: what it took out is no bias at all
    told = events(session, "device")[-1]["installed"]["in_samples"]
    assert max(np.abs(told["gyr_offset"])) > 1e-3
    for axis, right in zip("XYZ", conceals["gyr_bias"], strict=True):
        said = conceals["result"]["install"][f"INS_GYROFFS_{axis}"]
        assert abs(said["value"] - right) < 4.5 * said["sigma"]
    for axis, right in zip("XYZ", conceals["acc_bias"], strict=True):
        said = conceals["result"]["install"][f"INS_ACCOFFS_{axis}"]
        assert abs(said["value"] - right) < 4.5 * said["sigma"]


@pytest.mark.thorough
def test_written_after_another_start_and_once_more(
    restarted: tuple[Path, str, str, dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    session, url, control, _ = restarted
    to = [str(session), "--device", f"{url}?system=1&component=1", "--yes"]
    link = f"{url}?system=1&component=1".removeprefix("mavlink:")
    order(control, fault={"reboot_s": 0.1})
    assert main(["write", *to, "--json"]) == 0
    said = capsys.readouterr()
    assert "INS_GYR_CAL = 1: the autopilot averages its gyroscopes" in said.err
    wanted = {p["name"]: p["new"] for p in json.loads(said.out)["parameters"]}
    assert main(["write", *to]) == 0
    assert "all 9 parameters are installed already" in capsys.readouterr().err
    with ParameterLink(link) as autopilot:
        autopilot.write({"INS_GYROFFS_X": 0.002})  # as the next start does
    assert main(["write", *to]) == 0
    with ParameterLink(link) as autopilot:
        kept = autopilot.read(wanted)
        np.testing.assert_allclose([*kept.values()], [*wanted.values()], rtol=1e-6)
        autopilot.write({"INS_GYROFFS_X": 0.003})
    assert main(["undo", *to[:1], "--yes"]) == 0


def test_a_parameter_that_does_not_change_by_itself_still_refuses(
    restarted: tuple[Path, str, str, dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    session, url, _, _ = restarted
    link = f"{url}?system=1&component=1"
    with ParameterLink(link.removeprefix("mavlink:")) as autopilot:
        autopilot.write({"INS_ACCOFFS_Y": 0.7})
    assert main(["write", str(session), "--device", link, "--yes"]) == 2
    assert "INS_ACCOFFS_Y = 0.7 on the autopilot" in capsys.readouterr().err


def told(installed: InstalledCalibration, watch: InstalledWatch, offset: float) -> None:
    """One whole round of answers."""
    for some in parameter_names(ARDUPILOT, 0).values():
        for name in some:
            watch.hear(name, {"INS_GYROFFS_X": offset}.get(name, 1.0))


def test_it_is_read_until_it_is_stable() -> None:
    installed = InstalledCalibration(ARDUPILOT, 0)
    watch = InstalledWatch(installed)
    for offset, waits in ((0.0, True), (0.0, False)):
        told(installed, watch, offset)
        assert watch.is_reading is waits
    assert (watch.readings, watch.changes) == (1, 0)
    watch.start_over(STABLE_ROUNDS)
    for offset, waits in ((0.0, True), (0.1, True), (0.2, True), (0.2, False)):
        told(installed, watch, offset)
        assert watch.is_reading is waits
    assert watch.changes == 2
    assert installed.values["INS_GYROFFS_X"] == 0.2
    # an answer that nobody asked for, as when another program sets it
    watch.hear("INS_GYROFFS_X", 0.3)
    assert watch.is_reading and "INS_GYROFFS_X" not in watch.unheard


def test_samples_before_a_change_are_as_if_it_had_been_there() -> None:
    rng = np.random.default_rng(3)
    t = np.arange(100) / 10
    raw_acc, raw_gyr = rng.normal(0, 9, (100, 3)), rng.normal(0, 0.1, (100, 3))
    used: list[dict[str, Any]] = [
        {"acc_offset": [0.5, 0, 0], "acc_scale": [1, 1.02, 1], "gyr_offset": [0, 0, 0]},
        {"acc_offset": [0, 0, 1], "acc_scale": [0.9, 1, 1], "gyr_offset": [0, 0.1, 0]},
    ]
    acc, gyr = raw_acc.copy(), raw_gyr.copy()
    for first, o in zip((0, 50), used, strict=True):
        some = slice(first, first + 50)
        acc[some] = (raw_acc[some] - o["acc_offset"]) * o["acc_scale"]
        gyr[some] = raw_gyr[some] - o["gyr_offset"]
    marks: list[dict[str, Any]]
    marks = [{"event": "device", "installed": {"in_samples": used[0]}}]
    again: dict[str, Any] = {"event": "device", "installed": {"in_samples": used[1]}}
    marks.append({**again, "until_s": 4.0, "at_s": 6.0})
    recorded = Block.of(t, acc, gyr)
    one, said = under_last_calibration(recorded, marks)
    kept = (t <= 4.0) | (t > 6.0)
    np.testing.assert_array_equal(one.t, t[kept])
    new = (raw_acc - used[1]["acc_offset"]) * used[1]["acc_scale"]
    np.testing.assert_allclose(one.acc, new[kept], atol=1e-12)
    np.testing.assert_allclose(
        one.gyr, (raw_gyr - used[1]["gyr_offset"])[kept], atol=1e-12
    )
    assert len(said) == 1 and "20 are left out" in said[0]
    # told to correct nothing: what counts is the sensor's own output
    marks[1] = {**marks[1], "installed": {**marks[1]["installed"], "taken_out": True}}
    one, _ = under_last_calibration(recorded, marks)
    np.testing.assert_allclose(one.acc, raw_acc[kept], atol=1e-12)
    # a run that was broken off: sure up to its last window
    window = {"event": "window", "start_s": 1.0, "end_s": 3.0}
    broken = [marks[0], window, {**again, "at_s": 5.0}]
    one, _ = under_last_calibration(recorded, broken)
    np.testing.assert_array_equal(one.t, t[(t <= 3.0) | (t > 5.0)])
    # what nobody knows is not put together with what is known
    nothing = {"event": "device", "installed": {"in_samples": None}, "at_s": 6.0}
    unknown = [marks[0], nothing]
    assert under_last_calibration(recorded, unknown)[0].t[0] > 6.0
    same = [marks[0], {**marks[0], "at_s": 3.0}]
    assert under_last_calibration(recorded, same) == (recorded, ())
    assert NO_CORRECTION.keys() == used[0].keys()


def test_what_an_autopilot_takes_out_is_no_error_of_the_device() -> None:
    nominal = {
        "acc_bias": np.array([0.1, 0.0, 0.0]), "acc_scale": np.array([1.0, 1.1, 1.0]),
        "gyr_bias": np.zeros(3), "gyr_scale": np.ones(3),
    }  # fmt: skip
    used = {
        "acc_offset": [0.5, 0, 0], "acc_scale": [1, 1.02, 1], "gyr_offset": [0, 0, 0.04]
    }  # fmt: skip
    mark: dict[str, Any] = {"event": "device", "installed": {"in_samples": used}}
    sent = nominal_as_sent(nominal, [mark])
    force = np.array([3.0, -4.0, 8.0])
    by_sensor = nominal["acc_bias"] + nominal["acc_scale"] * force
    np.testing.assert_allclose(
        sent["acc_bias"] + sent["acc_scale"] * force,
        (by_sensor - used["acc_offset"]) * used["acc_scale"],
    )
    np.testing.assert_allclose(sent["gyr_bias"], [0, 0, -0.04])
    mark["installed"]["taken_out"] = True
    for marks in ([], [mark]):
        for name, value in nominal_as_sent(nominal, marks).items():
            np.testing.assert_array_equal(value, nominal[name])
