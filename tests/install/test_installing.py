"""A recalibration on top of the one an autopilot has: composed, shown, given back."""

import json
import shlex
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("fastcrc")
pytest.importorskip("pymavlink")

from processes import TWO_POSITION, simulated, steady, wait_for_samples

from fieldcal.cli import main
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.mavlink_imu import MavlinkImu
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.session.marks import mark_line

HAS = "INS_ACCOFFS_X=0.5&INS_ACCSCAL_Y=1.02&INS_GYROFFS_Z=0.01"


def recalibrated(folder: Path, has: str) -> tuple[int, Any]:
    folder.parent.mkdir(exist_ok=True)
    device = ["--mavlink", f"tcpin:127.0.0.1:0?{has}", "--rate", "100"]
    virtual = f"--virtual={shlex.join([*device, *steady(folder.parent)])}"
    run = [*TWO_POSITION, "--seconds", "10", "--speed", "20", "--json"]
    run += ["-o", str(folder), virtual]
    done = subprocess.run(run, capture_output=True, text=True, check=False)
    return done.returncode, json.loads(done.stdout)


ARDUPILOT = ("INS_ACCOFFS_{}", "INS_ACCSCAL_{}", "INS_GYROFFS_{}")
PX4 = ("CAL_ACC0_{}OFF", "CAL_ACC0_{}SCALE", "CAL_GYRO0_{}OFF")


@pytest.fixture(scope="module")
def recorded(
    tmp_path_factory: pytest.TempPathFactory,
) -> Callable[[str], tuple[Path, Any]]:
    """The session of an autopilot that has something, and its result; each once."""

    @cache
    def made(has: str) -> tuple[Path, Any]:
        folder = tmp_path_factory.mktemp("installed") / "session"
        code, result = recalibrated(folder, has)
        assert code == 0
        return folder, result

    return made


@pytest.mark.parametrize(
    ("has", "names"),
    [
        (HAS, ARDUPILOT),
        pytest.param(
            "autopilot=px4&CAL_ACC0_XOFF=0.5&CAL_ACC0_YSCALE=1.02",
            PX4,
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_what_to_install_is_the_truth_whatever_was_installed(
    has: str,
    names: tuple[str, ...],
    recorded: Callable[[str], tuple[Path, Any]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    session, result = recorded(has)
    folder = Path(shutil.copytree(session, tmp_path / "s"))
    truth = result["virtual"]
    wanted = (truth["acc_bias"], 1 / np.array(truth["acc_scale"]), truth["gyr_bias"])
    for name, right in zip(names, wanted, strict=True):
        for axis, value in zip("XYZ", right, strict=True):
            said = result["install"][name.format(axis)]
            assert abs(said["value"] - value) < 4.5 * said["sigma"], name
    assert main(["solve", str(folder)]) == 0
    assert f"install {names[0].format('X')} = " in capsys.readouterr().out


@pytest.fixture
def session(recorded: Callable[[str], tuple[Path, Any]]) -> Path:
    return recorded(HAS)[0]


def as_if(session: Path, folder: Path, name: str, value: float) -> str:
    """The same recording, had another parameter been installed."""
    shutil.copytree(session, folder)
    lines = (folder / "marks.jsonl").read_text().splitlines()
    mark = json.loads(lines[0])
    mark["installed"]["parameters"][name] = value
    mark.pop("crc32")
    changed = mark_line(mark).rstrip("\n")
    (folder / "marks.jsonl").write_text("\n".join([changed, *lines[1:]]) + "\n")
    assert main(["solve", str(folder)]) == 0
    return str(folder)


def test_a_calibration_is_applied_only_on_top_of_what_it_was_found_on(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = as_if(session, tmp_path / "other", "INS_ACCOFFS_X", 0.4)
    out = str(tmp_path / "out.csv")
    assert main(["apply", str(session), out]) == 0
    assert main(["apply", str(session), out, "--calibration", other]) == 2
    said = capsys.readouterr().err
    assert "was recorded with INS_ACCOFFS_X = 0.5 in the autopilot" in said


def test_a_turned_board_says_why_there_is_nothing_to_install(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    as_if(session, tmp_path / "turned", "AHRS_ORIENTATION", 4.0)
    said = capsys.readouterr().out
    assert "nothing to install in the autopilot: AHRS_ORIENTATION = 4 turns" in said
    assert "install INS" not in said


@contextmanager
def begun(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A run that has taken the calibration out and hears samples; its autopilot."""
    options = ["--mavlink", f"tcpin:127.0.0.1:0?{HAS}", "--speed", "5"]
    with simulated(*options) as (place, _):
        url = f"mavlink:{place}"
        run = subprocess.Popen(
            [*TWO_POSITION, "--device", f"{url}?installed=identity", "-o", str(folder)],
            stderr=subprocess.DEVNULL,
            text=True,
        )
        try:
            wait_for_samples(folder, run, 10_000)
            yield run, url
        finally:
            run.kill()
            run.wait()


def installed(url: str) -> InstalledCalibration:
    """What the autopilot has now."""
    with open_driver(url) as imu:
        assert isinstance(imu, MavlinkImu) and imu.installed is not None
        return imu.installed


@pytest.mark.thorough
@pytest.mark.parametrize(
    "number",
    [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.thorough)],
)
def test_a_run_that_is_told_to_end_gives_the_calibration_back(
    number: signal.Signals, tmp_path: Path
) -> None:
    with begun(tmp_path / "s") as (run, url):
        marks = (tmp_path / "s" / "marks.jsonl").read_text().splitlines()
        kept = json.loads(marks[0])["installed"]  # what to set by hand after a kill -9
        assert kept["taken_out"] and kept["parameters"]["INS_ACCOFFS_X"] == 0.5
        run.send_signal(number)
        run.send_signal(number)
        assert run.wait() == 130
        again = installed(url)
        np.testing.assert_allclose(again.vector("acc_offset"), [0.5, 0, 0])
        assert again.values["INS_GYROFFS_Z"] == pytest.approx(0.01)


def test_what_a_killed_run_left_out_can_be_given_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "s"
    with begun(folder) as (run, url):
        run.kill()
        run.wait()
        np.testing.assert_array_equal(installed(url).vector("acc_offset"), 0)
        assert main(["undo", str(folder), "--yes"]) == 0
        assert "INS_ACCOFFS_X: 0 -> 0.5 m/s²" in capsys.readouterr().out
        again = installed(url)
        np.testing.assert_allclose(again.vector("acc_offset"), [0.5, 0, 0])
        assert again.values["INS_ACCSCAL_Y"] == pytest.approx(1.02)
        assert main(["undo", str(folder), "--yes"]) == 2
        assert "nothing was written from there" in capsys.readouterr().err
