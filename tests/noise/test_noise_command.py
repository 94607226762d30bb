"""`fieldcal noise`: what it says, writes and refuses."""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
from dataclasses import replace
from pathlib import Path
from shutil import copytree
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pytest
from few_channels import only
from pyarrow import csv, parquet

from benchmarks.noise.processes import noise, recording
from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.samples import Block, concat
from fieldcal.history.store import History
from fieldcal.noise.document import NoiseResult
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder
from fieldcal.session.schemas import validator

N, K = 1e-5, 1e-7


def session(
    folder: Path,
    seconds: float = 1200,
    seed: int = 20,
    channels: tuple[int, ...] = (0, 1, 2, 3, 4, 5),
    **about: str,
) -> Path:
    """A device of navigation grade at rest, 10 Hz."""
    rng = np.random.default_rng(seed)
    values = only(noise(rng, int(10 * seconds), 0.1, 6, N=N, K=K), *channels)
    device = {"name": "bench", "grade": "navigation", **about}
    tables = {"format": 1, "device": device, "site": {"latitude_deg": 60.0}}
    with Recorder(folder, tables) as recorder:
        recorder.append(recording(values, 0.1))
    return folder


class Told(NamedTuple):
    """What the command said of a session: its folder, the screen, the page."""

    folder: Path
    screen: str
    page: str

    @property
    def content(self) -> dict[str, Any]:
        """What it wrote."""
        found: dict[str, Any] = json.loads((self.folder / "noise.json").read_text())
        return found


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> Told:
    place = tmp_path_factory.mktemp("noise")
    folder, page = session(place / "night"), place / "noise.html"
    screen = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(screen):
        patch.setenv("COLUMNS", "80")
        assert main(["noise", str(folder), "--report", str(page)]) == 0
    return Told(folder, screen.getvalue(), page.read_text(encoding="utf-8"))


def test_what_is_written_holds_to_its_schema_and_is_true(told: Told) -> None:
    validator("noise").validate(told.content)
    assert list(told.content["channels"]) == ["ax", "ay", "az", "gx", "gy", "gz"]
    for channel in told.content["channels"].values():
        white = channel["processes"]["N"]
        assert abs(white["value"] - N) < 4 * white["sigma"]
        means = channel["averaging"]
        # (1) of the standard, and the walk's part
        truth = [math.sqrt(N**2 / s + K**2 * s / 3) for s in means["seconds"]]
        assert means["sigma"][:3] == pytest.approx(truth[:3], rel=0.3)


def test_json_is_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And the same whenever it is asked for."""
    folder = session(tmp_path / "short", 200, channels=(0, 4))
    assert main(["noise", str(folder)]) == 0
    before = json.loads((folder / "noise.json").read_text())
    capsys.readouterr()
    assert main(["noise", str(folder), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == json.loads((folder / "noise.json").read_text())
    assert said["channels"] == before["channels"]


def test_what_other_programs_are_told_follows_from_the_two_numbers(told: Told) -> None:
    programs = told.content["for"]
    density = programs["kalibr"]["gyroscope_noise_density"]
    pairs = [
        c["two_numbers"] for n, c in told.content["channels"].items() if n[0] == "g"
    ]
    loud = max(pairs, key=lambda pair: pair["N"])
    assert density["value"] == loud["N"]
    assert density["value"] / loud["left_out"] == pytest.approx(N, rel=0.03)
    # a step of 12 ms adds (h w)^2 to the variance of an angle: N^2 h
    held = programs["ardupilot"]["EK3_GYRO_P_NSE"]["value"]
    assert (0.012 * held) ** 2 == pytest.approx(density["value"] ** 2 * 0.012)
    bias = programs["px4"]["EKF2_ACC_B_NOISE"]["value"]
    walk = programs["kalibr"]["accelerometer_random_walk"]["value"]
    assert (0.01 * bias) ** 2 == pytest.approx(walk**2 * 0.01)
    variance = programs["ros"]["angular_velocity_covariance[8]"]["value"]
    assert variance == pytest.approx(N**2 * 10, rel=0.1)


def test_the_screen_fits_80_columns_and_every_number_has_its_uncertainty(
    told: Told,
) -> None:
    lines = told.screen.splitlines()
    tables = [x for x in lines if x[:3] in ("ax ", "ay ", "az ", "gx ", "gy ", "gz ")]
    assert len(tables) == 12 and max(map(len, tables)) <= 80
    assert all("±" in line for line in tables)
    for word in ("instability", "over 60 s", "kalibr:", "EK3_GBIAS_P_NSE", "EKF2_ACC",
                 "recalibrate:", "north", "by noise alone", "written:"):  # fmt: skip
        assert word in told.screen


def test_the_page_has_the_curves(told: Told) -> None:
    for word in ("Allan deviation, gyroscopes", "gz model", "EKF2_GYR_NOISE", "bench"):
        assert word in told.page
    assert "src=" not in told.page and 'href="http' not in told.page


def test_several_sessions_of_a_device_count_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = (
        str(session(tmp_path / str(seed), 600, seed, channels=(0,)))
        for seed in (20, 21)
    )
    assert main(["noise", first, "--json"]) == 0
    one = json.loads(capsys.readouterr().out)
    assert main(["noise", second, first, "--json"]) == 0
    both = json.loads(capsys.readouterr().out)
    assert both["stretches"] == 2 and both["seconds"] == pytest.approx(1200, abs=1)
    sigma = [x["channels"]["ax"]["processes"]["N"]["sigma"] for x in (both, one)]
    assert sigma[0] < 0.9 * sigma[1]


def test_the_history_tells_when_to_recalibrate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Four calibrations of one axis, of which one was stored late."""
    folder = session(tmp_path / "night", 60, serial="A1")
    history = History(tmp_path / "history")
    about = {"device": {"serial": "A1"}, "decision": {"go": True}}
    for month, bias in ((4, 0.3), (1, 0.1), (3, 0.2), (2, 0.0)):
        found = Calibration(
            "joint", ("acc_bias.x",), np.array([bias]), np.array([[1e-8]]), ("m/s^2",),
            1.0, 1, 1e-3, info=about,
        )  # fmt: skip
        history.add(f"2026-0{month}-01T10:00:00", tmp_path / str(month), found)
    arguments = ["noise", str(folder), "--json", "--history"]
    assert main([*arguments, str(tmp_path / "history")]) == 0
    told = json.loads(capsys.readouterr().out)["recalibrate"]
    assert told["since"].startswith("2026-04-01T10:00")
    assert [n for n, r in told["channels"].items() if r["from_history"]] == ["ax"]
    # a month changes it by 0.15 m/s^2, far more than any limit
    assert told["channels"]["ax"]["after_s"][1] < 86400


def test_a_session_counts_once(told: Told, capsys: pytest.CaptureFixture[str]) -> None:
    again = told.folder.parent / "." / told.folder.name / ".." / told.folder.name
    assert main(["noise", str(told.folder), str(again)]) == 2
    assert "is there twice: give each session once" in capsys.readouterr().err


def test_a_copy_of_a_recording_is_refused(
    told: Told, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copytree(told.folder, tmp_path / "copy")
    assert main(["noise", str(told.folder), str(tmp_path / "copy")]) == 2
    assert f"copy: has the samples of {told.folder}" in capsys.readouterr().err


def test_sessions_of_two_devices_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seeds = {"A1": 20, "B2": 21}
    paths = [str(session(tmp_path / n, 60, i, serial=n)) for n, i in seeds.items()]
    assert main(["noise", *paths]) == 2
    assert "is of device B2" in capsys.readouterr().err


def test_sessions_of_two_rates_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What a clock is off by is no other rate."""
    rng = np.random.default_rng(25)
    paths = []
    for rate in (50.0, 200.0, 50.5):
        values = only(noise(rng, int(60 * rate), 1 / rate, 6, N=N), 5)
        block = recording(values, 1 / rate)
        paths.append(tmp_path / f"{rate:g}")
        with Recorder(paths[-1], {"format": 1}) as recorder:
            recorder.append(block)
    assert main(["noise", *map(str, paths)]) == 2
    said = capsys.readouterr().err
    assert f"{paths[0]} has 50 samples a second" in said
    assert f"{paths[1]} has 200: estimate the noise of each rate by itself" in said
    assert main(["noise", str(paths[0]), str(paths[2])]) == 0


def test_what_is_too_short_or_no_session_is_refused_with_a_remedy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["noise", str(session(tmp_path / "short", 20))]) == 2
    assert "record 30 s at least" in capsys.readouterr().err
    assert main(["noise", str(tmp_path / "nothing")]) == 2
    assert "is no session" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--report", "--limits"])
def test_what_is_needed_at_the_end_is_looked_at_first(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    option: str,
) -> None:
    """Before the noise of a night is estimated."""

    def estimate_too_early(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr("fieldcal.noise.estimate_noise", estimate_too_early)
    night, file = str(session(tmp_path / "night", 60)), str(tmp_path / "none" / "x")
    assert main(["noise", night, option, file]) == 2
    assert file in capsys.readouterr().err


@pytest.mark.parametrize("ending", ["csv", "csv.gz", "parquet"])
def test_a_recording_of_any_kind_is_read_in_parts(tmp_path: Path, ending: str) -> None:
    """The same samples, whatever file they are in and however it is read."""
    source = session(tmp_path / "source", 200)
    block = Session.open(source).block
    target = tmp_path / "target"
    target.mkdir()
    (target / "session.toml").write_text("format = 1\n")
    apply_to(block, target / f"samples.{ending}")
    parts = concat(Session.open(target).blocks())
    whole = Session.open(target).block
    for name in ("t", "acc", "gyr"):
        assert np.array_equal(getattr(parts, name), getattr(whole, name))
    assert whole.acc == pytest.approx(block.acc)


def apply_to(block: Block, path: Path) -> None:
    """Write samples with another program's writer."""
    columns = dict(zip(("ax", "ay", "az", "gx", "gy", "gz"), block.six.T, strict=True))
    table = pa.table({"t": block.t, **columns, "mine": ["text"] * len(block)})
    if path.name.endswith(".parquet"):
        parquet.write_table(table, path)
    else:
        with pa.output_stream(path) as stream:  # packed by the name's ending
            csv.write_csv(table, stream)


def test_behind_a_damaged_place_it_goes_on(tmp_path: Path) -> None:
    """As the whole recording is read, whatever byte is another."""
    file = session(tmp_path / "night", 60) / "samples.arrows"
    with Recorder(tmp_path / "parts", {"format": 1}) as recorder:
        block = Session.open(file.parent).block
        for first in range(0, len(block), 100):
            recorder.append(block[first : first + 100])
            recorder.flush()
    file, good = tmp_path / "parts" / "samples.arrows", bytearray()
    good[:] = file.read_bytes()
    for place in (len(good) // 7, len(good) // 2, len(good) - 3000):
        bad = good.copy()
        bad[place : place + 8] = b"\x55" * 8
        file.write_bytes(bad)
        parts = concat(Session.open(file.parent).blocks())
        whole = Session.open(file.parent).block
        assert 0 < len(whole) < len(block)
        assert np.array_equal(parts.t, whole.t)
        assert np.array_equal(parts.acc, whole.acc)


def test_a_file_is_imported_on_the_way(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    values = noise(np.random.default_rng(23), 2000, 0.02, 6, N=N)
    values[:, 2] += 9.81
    rows = [f"{0.02 * i:.2f}," + ",".join(f"{x:.9f}" for x in row)
            for i, row in enumerate(values)]  # fmt: skip
    names = ["ax [m/s^2]", "ay [m/s^2]", "az [m/s^2]"]
    names += ["gx [rad/s]", "gy [rad/s]", "gz [rad/s]"]
    file = tmp_path / "log.csv"
    file.write_text("\n".join([",".join(["t [s]", *names]), *rows]) + "\n")
    assert main(["noise", str(file), "--json"]) == 0
    said = capsys.readouterr()
    told = json.loads(said.out)
    assert str(file) in said.err and "fieldcal-noise-" not in said.err
    assert told["sessions"] == [str(file)] and os.listdir(tmp_path) == ["log.csv"]
    assert told["channels"]["gy"]["processes"]["N"]["value"] == pytest.approx(
        N, rel=0.1
    )
    file.write_text("\n".join(row.partition(",")[2] for row in rows) + "\n")
    assert main(["noise", str(file)]) == 2
    assert "fieldcal import takes that" in capsys.readouterr().err


def test_rows_out_of_order_are_named_when_read_in_parts(tmp_path: Path) -> None:
    (tmp_path / "session.toml").write_text("format = 1\n")
    rows = [f"{t},1,2,3" for t in (0.0, 0.1, 0.3, 0.2)]
    (tmp_path / "samples.csv").write_text("\n".join(["t,ax,ay,az", *rows]) + "\n")
    with pytest.raises(Exception, match="row 4, column t"):
        concat(Session.open(tmp_path).blocks())


def test_a_turn_between_windows_is_no_noise(tmp_path: Path) -> None:
    rng = np.random.default_rng(22)
    values = noise(rng, 3000, 0.1, 6, N=N)
    values[1000:1400] += rng.standard_normal((400, 6))
    values[1400:, 0] += 5.0
    values = only(values, 0, 4)
    windows = [(0.0, 99.0), (141.0, 299.0)]
    with Recorder(
        tmp_path / "turned",
        {
            "format": 1,
            "position": [{"start_s": a, "end_s": b} for a, b in windows],
        },
    ) as recorder:
        recorder.append(recording(values, 0.1))
    from fieldcal.commands.noise import noise_result

    found: NoiseResult = noise_result([Session.open(tmp_path / "turned")])
    assert found.model.stretches == 2 and len(found.model.channels) == 2
    for channel in found.model.channels.values():
        assert channel.processes["N"].value == pytest.approx(N, rel=0.1)


def test_windows_are_found_behind_a_clock_that_was_set(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Windows are in the device's times, which jump; samples come in several parts."""
    rng = np.random.default_rng(26)
    values = noise(rng, 6000, 0.02, 6, N=N)
    values[1000:2500] += rng.standard_normal((1500, 6))
    block = recording(only(values, 0), 0.02)
    times = block.t + np.where(block.t >= 70.0, 1.7e9, 0.0)
    windows = [(0.0, 19.9), (1.7e9 + 71.0, 1.7e9 + 119.0)]
    tables = {
        "format": 1,
        "position": [{"start_s": a, "end_s": b} for a, b in windows],
    }
    with Recorder(tmp_path / "set", tables) as recorder:
        for i in range(0, 6000, 500):
            part = slice(i, i + 500)
            recorder.append(replace(block[part], t=times[part]))
    assert main(["noise", str(tmp_path / "set"), "--json"]) == 0
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert found["seconds"] == pytest.approx(67.9, abs=0.5)
    assert found["channels"]["ax"]["processes"]["N"]["value"] == pytest.approx(
        N, rel=0.1
    )
    assert "the device's clock jumps" in err


def test_a_plan_says_how_long_this_device_is_worth_averaging(
    told: Told, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    noisy, folder = told.content["channels"], told.folder
    assert main(["plan", "--set", "two", "--noise-of", str(folder)]) == 0
    out = capsys.readouterr().out
    assert "this device" in out and "best after" in out
    assert main(["plan", "--set", "two", "--noise-of", str(folder), "--json"]) == 0
    sigma = json.loads(capsys.readouterr().out)["sigma"]
    worst = max(noisy[n]["averaging"]["sigma"][2] for n in ("gx", "gy", "gz"))
    # two means of 60 s of the same gyroscope
    assert sigma["gyr_bias.x"] == pytest.approx(worst / math.sqrt(2), rel=0.05)
    assert main(["plan", "--noise-of", str(tmp_path)]) == 2
    assert "run fieldcal noise" in capsys.readouterr().err
    (tmp_path / "noise.json").write_text('{"format": 2}')
    assert main(["plan", "--noise-of", str(tmp_path)]) == 2
    assert "noise.json" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("triad", "says", "words"),
    [("a", "accelerometers", []), ("g", "gyroscopes", ["--speed", "20"])],
)
def test_a_plan_needs_the_noise_of_what_it_calibrates(
    triad: str,
    says: str,
    words: list[str],
    told: Told,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A device of one triad: what nobody measured is neither quiet nor infinite."""
    known = {n: c for n, c in told.content["channels"].items() if n[0] != triad}
    text = json.dumps({**told.content, "channels": known})
    (tmp_path / "noise.json").write_text(text)
    words = ["plan", "--noise-of", str(tmp_path), *words]
    assert main(words) == 2
    assert f"says nothing of the {says}" in capsys.readouterr().err


def test_a_swaying_base_is_planned_for_without_gyroscopes(
    told: Told, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    known = {n: c for n, c in told.content["channels"].items() if n[0] == "a"}
    text = json.dumps({**told.content, "channels": known})
    (tmp_path / "noise.json").write_text(text)
    needed = []
    for folder in (told.folder, tmp_path):
        words = ["plan", "--json", "--sways", "0.2", "--noise-of", str(folder)]
        assert main(words) == 0
        needed.append(json.loads(capsys.readouterr().out)["needed_s"])
    assert needed[1] <= needed[0] < 60.0


def test_the_report_of_the_session_says_how_long_to_average(told: Told) -> None:
    page = told.folder / "report.html"
    assert main(["report", str(told.folder)]) == 0
    text = page.read_text(encoding="utf-8")
    for page_text in (text, told.page):
        assert "Error of a mean; the papers average for 30 to 60 s" in page_text
        best = told.content["channels"]["gx"]["averaging"]["best_sigma"]
        assert f">{best:.2g}</td>" in page_text
