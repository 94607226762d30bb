"""Parameters against the averaging time, of sessions of the virtual device."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.calibration import over_time
from fieldcal.cli import main
from fieldcal.core.samples import Array
from fieldcal.evaluation.nested_windows import NestedWindows, solve_nested_windows
from fieldcal.session.folder import Session
from fieldcal.sim_device import profile as device
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.vocabulary import parse

FIVE = [(0, 0), (22.5, 0), (22.5, 2.5), (45, 2.5), (45, 5)]
PERFECT = {"squareness": 1e-9, "quadratic": 1e-12, "g_sensitivity": 1e-12}


def session(
    folder: Path, *effects: str, setting: float = 1e-4, flicker: float = 0.0
) -> Session:
    """Five positions of a minute."""
    profile = Profile(
        sampling=device.Sampling(50.0),
        noise=device.NoiseFigures(
            acc=(5e-3,) * 3, gyr=(1e-3,) * 3, acc_flicker=(flicker,) * 3,
            acc_instability=device.ZERO, gyr_instability=device.ZERO,
        ),
        effects=tuple(parse(e) for e in effects),
    )  # fmt: skip
    held = places(FIVE, seconds=60.0)
    site = {"latitude_deg": 50.45, "angle_setting_deg": setting}
    block = recorded(profile, held, 3)
    return Session.open(write_session(folder, block, held, site=site, device=PERFECT))


def found(folder: Path, *effects: str, **how: Any) -> NestedWindows:
    out = solve_nested_windows(session(folder, *effects, **how))
    assert out is not None
    assert out.seconds.tolist() == [5, 10, 15, 30, 45, 60]
    return out


@pytest.mark.thorough
def test_white_noise_falls_with_the_root_of_the_time(tmp_path: Path) -> None:
    made = found(tmp_path)
    k = [made.names.index(f"acc_bias.{axis}") for axis in "xyz"]
    fall = made.noise[0, k] / made.noise[-1, k]
    assert fall == pytest.approx(np.sqrt(12.0), rel=0.3)
    late = ("fixture", 60.0)  # what a factory leaves is as large as noise then
    assert {made.dominant_error(f"acc_bias.{axis}") for axis in "xy"} <= {None, late}
    assert made.dominant_error("acc_bias.z") == ("fixture", 10.0), (
        "of a base off by 0.05 deg"
    )


@pytest.mark.thorough
def test_what_the_fixture_leaves_stays(tmp_path: Path) -> None:
    made = found(tmp_path, setting=0.05)
    k = made.names.index("acc_bias.y")
    assert made.sigma[-1, k] > 0.9 * made.sigma[0, k] > 0.9 * made.noise[0, k]
    assert made.dominant_error("acc_bias.y") == ("fixture", 5.0)


@pytest.mark.thorough
def test_flicker_wins_in_its_time(tmp_path: Path) -> None:
    made = found(tmp_path, flicker=2e-3)
    what, seconds = made.dominant_error("acc_bias.x") or ("", 0.0)
    assert what == "flicker"
    assert 10 <= seconds <= 30  # spectra of five seconds show little of it


def of(values: Array, noise: Array) -> NestedWindows:
    t = np.array([5.0, 10.0, 20.0, 40.0])
    sigma = np.hypot(noise, 0.0)[:, None]
    return NestedWindows(("p",), ("1",), t, values[:, None], sigma, noise[:, None])


def test_a_value_that_walks_off_is_no_noise() -> None:
    noise = 1 / np.sqrt(np.array([5.0, 10.0, 20.0, 40.0]))
    rng = np.random.default_rng(0)
    apart = []
    for _ in range(300):
        steps = rng.standard_normal(40).cumsum()
        values = np.array([steps[i - 1] / i for i in (5, 10, 20, 40)])
        apart.append(of(values, noise).dominant_error("p"))
    assert sum(one is not None for one in apart) <= 2
    moved = np.array([0.0, 0.0, 1.0, 1.0])
    assert of(moved, noise).dominant_error("p") == ("drift", 20.0)
    assert of(moved, 2 * noise).dominant_error("p") is None


def test_windows_that_cannot_be_cut_say_so(tmp_path: Path) -> None:
    one = session(tmp_path)
    short = tuple(w and (w[0], w[0] + 4.0) for w in one.windows)
    assert solve_nested_windows(one.with_windows(short)) is None
    assert solve_nested_windows(one.with_windows(())) is None


@pytest.mark.thorough
def test_console_result_and_report_have_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session(tmp_path, setting=0.05)
    assert main(["solve", str(tmp_path), "--over-time"]) in (0, 1)
    out = capsys.readouterr().out
    said = "what fixture and factory leave is more than noise from 5 s on: "
    assert "by averaging time" in out and f"{said}acc bias x, acc bias y" in out
    told = json.loads((tmp_path / "result.json").read_text())["over_time"]
    assert told["parameters"]["acc_bias.y"]["wins"] == {"what": "fixture", "from_s": 5}
    assert len(over_time.heading(told)) == len(over_time.rows(told)[0]) == 7
    assert main(["report", str(tmp_path)]) == 0
    page = (tmp_path / "report.html").read_text()
    assert said[1:] in page and "by averaging time" in page
