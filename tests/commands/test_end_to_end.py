"""Two processes and a pty between them: the main job, and everything that breaks it."""

from __future__ import annotations

import json
import shlex
import signal
import subprocess
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import RUN, Recalibrated, steady, wait_for_samples
from talking import talking

from fieldcal.cli import main
from fieldcal.run.movers import VirtualMover
from fieldcal.session import sample_files
from fieldcal.session.folder import Session
from fieldcal.solve import Observations

TILTED = "--virtual=--base-tilt=1,-1"


def test_five_positions_find_what_the_virtual_device_conceals(
    recalibrated: Recalibrated,
) -> None:
    result = recalibrated.result
    assert result["method"] == "joint" and result["verdict"] == "good"
    truth = {**result["virtual"], "base_tilt": [1.0, -1.0]}
    for group in ("acc_bias", "acc_scale", "gyr_bias", "base_tilt"):
        found = result["parameters"][group]
        pull = np.subtract(found["value"], truth[group]) / np.array(found["sigma"])
        assert np.abs(pull).max() < 4.5, group
    # 0.099 to 0.104 deg in runs that differ by their timing alone
    assert max(result["parameters"]["base_tilt"]["sigma"]) < 0.12


def test_progress_is_json_lines_on_standard_error(
    recalibrated: Recalibrated,
) -> None:
    events = [json.loads(line)["event"] for line in recalibrated.progress.splitlines()]
    assert events.count("place") >= 5 and events.count("taken") == 5


def test_a_run_leaves_its_report(recalibrated: Recalibrated) -> None:
    page = (recalibrated.folder / "report.html").read_text(encoding="utf-8")
    assert (
        "Apply it: the numbers hold within their ±." in page
        and "base tilt about x" in page
    )


@pytest.mark.thorough
def test_solving_the_recorded_session_gives_the_same_numbers(
    recalibrated: Recalibrated, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, result = recalibrated.copy(tmp_path / "s"), recalibrated.result
    assert main(["solve", str(folder), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    for group, found in result["parameters"].items():
        other = again["parameters"][group]
        for key, close in (("value", 1e-9), ("sigma", 1e-6)):
            one, two = (np.array(f[key], float) for f in (other, found))
            np.testing.assert_allclose(one, two, rtol=close, atol=1e-12)


@pytest.mark.thorough
def test_a_level_base_is_enough_for_two_positions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(
        ["run", "two_position", "--headless"]
        + [f"--virtual={shlex.join(steady(tmp_path))}", "--no-report", "--json"]
        + ["-o", str(tmp_path / "s"), "--level=0.001", "--angles=0.001"]
        + ["--speed", "60", "--squareness", "1e-5"]
    )
    out, err = capsys.readouterr()
    assert code == 0, err
    result = json.loads(out)
    assert result["method"] == "two_position"
    found = result["parameters"]["acc_bias"]
    off = np.subtract(found["value"], result["virtual"]["acc_bias"])
    assert (np.abs(off) < 4.5 * np.array(found["sigma"])).all()


@pytest.mark.thorough
def test_a_tilt_that_two_positions_cannot_see_is_never_go(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Unsaid it is NO-GO, and said it is in the uncertainty, without a second turn."""
    bias = "--acc-bias=0.1,-0.2,0.1"
    virtual = shlex.join(["--base-tilt=0.5,-0.3", bias, *steady(tmp_path)])
    code = main(
        ["run", "two_position", "--headless", f"--virtual={virtual}", "--json"]
        + ["--no-report", "-o", str(tmp_path / "s"), "--angles=0.001"]
        + ["--speed", "60", "--squareness", "1e-5"]
    )
    out, err = capsys.readouterr()
    assert code == 1, err
    told = [json.loads(line) for line in err.splitlines()]
    first = next(i for i, line in enumerate(told) if line["event"] == "place")
    assert any("how level the base is" in line.get("text", "") for line in told[:first])
    result = json.loads(out)
    truth = result["virtual"]["acc_bias"]
    assert "how level the base is" in result["decision"]["reasons"][0]
    off = np.subtract(result["parameters"]["acc_bias"]["value"], truth)
    assert np.abs(off).max() > 0.03, "the tilt is taken for a bias"
    again = solved(capsys, tmp_path / "s", "--level", "0.5")
    assert again["level_sigma_deg"] == pytest.approx(0.5)
    found = again["parameters"]["acc_bias"]
    off = np.subtract(found["value"], truth)
    assert (np.abs(off) < 3 * np.array(found["sigma"])).all()
    assert "acc_bias" in again["decision"]["reasons"][0], "known too badly for a launch"
    said = solved(capsys, tmp_path / "s", "--level", "0.001")["decision"]
    assert not said["go"], "no unit of the grade is as such a level makes it"
    assert any(c["name"] == "grade" for c in said["checks"])


def solved(
    capsys: pytest.CaptureFixture[str], session: Path, *options: str
) -> dict[str, Any]:
    """What `fieldcal solve` makes of a session."""
    main(["solve", str(session), "--json", *options])
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


@pytest.mark.parametrize("times", [1, pytest.param(3, marks=pytest.mark.thorough)])
def test_killed_at_any_moment_the_session_holds_all_that_was_in_the_file(
    tmp_path: Path, times: int
) -> None:
    rng = np.random.default_rng(2)
    for attempt in range(times):
        folder = tmp_path / str(attempt)
        process = subprocess.Popen(
            [*RUN, "five_position", "--headless", TILTED, "--speed", "20"]
            + ["-o", str(folder)],
            stderr=subprocess.DEVNULL,
        )
        wait_for_samples(folder, process, int(rng.uniform(5_000, 200_000)))
        there = len(sample_files.read_samples(folder / "samples.arrows")[0])
        process.send_signal(signal.SIGKILL)
        process.wait()
        session = Session.open(folder)
        block = session.block
        assert "cut off" in session.warnings[0]
        assert (np.diff(block.t) > 0).all()
        assert len(block) >= there > 50
        assert main(["solve", str(folder)]) in (1, 2), "two windows are never GO"


def test_an_interrupted_run_ends_with_130_and_keeps_what_was_recorded(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "s"
    process = subprocess.Popen(
        [*RUN, "five_position", "--headless", TILTED, "--speed", "20"]
        + ["-o", str(folder)],
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for_samples(folder, process, 5000)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate()
    assert process.returncode == 130 and "interrupted" in said
    assert "what was recorded is kept" in said
    session = Session.open(folder)
    assert len(session.block) > 0 and not session.warnings


def device_error(
    port: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> tuple[int, str]:
    code = main(
        ["run", "two_position", "--headless", "--device", f"serial:{port}"]
        + ["--patience", "1"]
        + ["-o", str(folder)]
    )
    lines = capsys.readouterr().err.strip().splitlines()
    return code, lines[-1]


def test_a_port_that_is_not_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = device_error("/dev/ttyNOWHERE", tmp_path / "s", capsys)
    assert code == 3 and "/dev/ttyNOWHERE" in said and "no such port" in said.lower()
    assert not (tmp_path / "s").exists()


@pytest.mark.usefixtures("soon_silent")
def test_a_port_that_says_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with talking(lambda i: b"") as port:
        code, said = device_error(f"{port}?format=witmotion", tmp_path / "s", capsys)
    assert code == 3 and "check" in said
    assert not (tmp_path / "s").exists()  # nothing came that could be kept


@pytest.mark.usefixtures("soon_silent")
def test_a_port_that_says_nothing_sensible(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with talking(lambda i: bytes(range(128, 160))) as port:
        code, said = device_error(f"{port}?format=witmotion", tmp_path / "s", capsys)
    assert code == 3 and ("format" in said or "baud" in said)


def silenced(device: VirtualMover, folder: Path) -> None:
    """Silence a device once some of what it said is recorded."""
    wait_for_samples(folder, None, 60_000)
    device.ask(fault={"silence_s": 1e6})


@pytest.mark.thorough
def test_a_device_that_goes_silent_keeps_what_it_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "s"
    with VirtualMover(["--serial", "witmotion", "--speed", "20"]) as device:
        threading.Thread(target=silenced, args=(device, folder), daemon=True).start()
        code, said = device_error(f"{device.port}?format=witmotion", folder, capsys)
    assert code == 3 and "silent" in said
    assert len(Session.open(folder).block) > 500


def test_observations_of_zero_gravity_are_refused() -> None:
    from fieldcal.core.errors import InputError
    from fieldcal.core.positions import TWO_POSITIONS

    with pytest.raises(InputError, match="gravity is 0"):
        Observations(
            TWO_POSITIONS, np.zeros((2, 6)), np.tile(np.eye(6), (2, 1, 1)), 0.0
        )
