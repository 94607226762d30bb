"""The calibrations of a device: kept, shown, compared, and never let into a new one."""

from __future__ import annotations

import json
import shutil
import sqlite3
import subprocess
import sys
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from fieldcal.acceptance.assessment import assess, store_in_history
from fieldcal.calibration import Calibration, limits
from fieldcal.cli import main
from fieldcal.commands.history import trend_lines
from fieldcal.commands.report import write_report
from fieldcal.core.errors import InputError
from fieldcal.evaluation.observations import observe, with_provenance
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.history.location import default_location
from fieldcal.history.store import History, family_runs
from fieldcal.history.trend import parameter_trend
from fieldcal.session.folder import Session
from fieldcal.session.marks import MARKS, mark_line
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.replay import simulate
from fieldcal.solve import solve

BOUNDS = limits.read("tactical")


def calibration(bias: float = 0.2, go: bool = True, sigma: float = 1e-3) -> Calibration:
    return Calibration(
        "joint",
        ("acc_bias.x", "gyr_bias.x"),
        np.array([bias, 0.01]),
        np.diag([sigma**2, 1e-10]),
        ("m/s^2", "rad/s"),
        1.0,
        1,
        1e-3,
        info={
            "device": {"serial": "A1"},
            "decision": {"go": go},
            "conditions": {"temperature_degc": 21.5, "latitude_deg": 50.0},
            "site": {"height_m": 170.0},
            "software": "fieldcal 9",
        },
    )


def filled(path: Path, *biases: float) -> History:
    history = History(path)
    for day, bias in enumerate(biases, start=1):
        at = f"2026-03-{day:02d}T10:00:00+00:00"
        history.add(at, Path(f"/s/{day}"), calibration(bias))
    return history


def test_what_is_kept_comes_back_whole(tmp_path: Path) -> None:
    history = filled(tmp_path / "deep" / "h.sqlite", 0.2, 0.21)
    runs = history.runs("A1")
    assert [r.number for r in runs] == [1, 2] and runs[0].go and not runs[0].accepted
    assert runs[0].temperature == 21.5 and runs[0].latitude_deg == 50.0
    assert runs[0].height_m == 170.0 and runs[0].software == "fieldcal 9"
    found = runs[1].calibration
    np.testing.assert_array_equal(found.covariance, calibration().covariance)
    assert found.value("acc_bias.x") == 0.21
    assert history.serials() == [("A1", 2, "2026-03-02T10:00:00+00:00")]
    assert history.runs("B2") == () and History(tmp_path / "none").serials() == []


def test_a_session_solved_again_replaces_itself(tmp_path: Path) -> None:
    history = filled(tmp_path / "h.sqlite", 0.2, 0.21)
    history.add("2026-03-01T10:00:00+00:00", Path("/s/1"), calibration(0.3))
    values = [r.calibration.value("acc_bias.x") for r in history.runs("A1")]
    assert values == [0.3, 0.21]


def test_without_a_serial_number_nothing_is_kept(tmp_path: Path) -> None:
    nameless = replace(calibration(), info={})
    with pytest.raises(InputError, match="--serial"):
        History(tmp_path / "h").add("2026", Path("/s"), nameless)


def test_several_processes_may_add_at_once(tmp_path: Path) -> None:
    code = (
        "import json, sys\nfrom pathlib import Path\n"
        "from fieldcal.calibration import Calibration\n"
        "from fieldcal.history.store import History\n"
        "found = Calibration.from_json(json.loads(sys.argv[3]))\n"
        "for i in range(4): History(Path(sys.argv[1])).add(\n"
        "    '2026', Path(f'/{sys.argv[2]}/{i}'), found)"
    )
    call = [sys.executable, "-c", code, str(tmp_path / "h")]
    found = json.dumps(calibration().to_json())
    both = [subprocess.Popen([*call, name, found]) for name in "ab"]
    assert [p.wait() for p in both] == [0, 0]
    assert len(History(tmp_path / "h").runs("A1")) == 8


@pytest.mark.parametrize("content", [b"", b"no database at all" * 100, b"SQLite for"])
def test_a_damaged_file_is_said_and_a_run_goes_on(
    tmp_path: Path, content: bytes
) -> None:
    path = tmp_path / "h.sqlite"
    path.write_bytes(content)
    session = bench(tmp_path / "s")
    found = solve(observe(session)[0])
    made = assess(found, session, usable_windows(session), BOUNDS, History(path))
    assert made.info["decision"]["checks"]
    assert np.array_equal(made.values, found.values)
    if content:
        assert any("name another with --history" in w for w in made.warnings)
        assert "not stored" in store_in_history(History(path), session, made)


def test_a_history_of_another_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "h.sqlite"
    with sqlite3.connect(path) as db:
        db.execute("PRAGMA user_version = 99")
    db.close()
    with pytest.raises(InputError, match="no history of this version"):
        History(path).runs("A1")


def test_the_place_is_that_of_the_user_unless_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("FIELDCAL_HISTORY", "/x/h.sqlite")
    assert default_location() == Path("/x/h.sqlite")
    monkeypatch.delenv("FIELDCAL_HISTORY")
    monkeypatch.setenv("XDG_DATA_HOME", "/data")
    assert default_location() == Path("/data/fieldcal/history.sqlite")


def bench(folder: Path, taken_at: str = "2026-06-01T10:00:00Z") -> Session:
    """A session of a virtual device with a serial number, two positions.

    Its time is unknown if `taken_at` is empty.
    """
    import pyarrow as pa
    import pyarrow.parquet

    from fieldcal.session.sample_table import to_record_batch

    folder.mkdir()
    windows = [(0.0, 0.0, 5.0, 15.0), (np.pi / 4, np.radians(5.0), 25.0, 35.0)]
    block = simulate(Profile(), windows, seed=1)
    table = pa.Table.from_batches([to_record_batch(block)])
    pyarrow.parquet.write_table(table, folder / "samples.parquet")
    lines_ = ['[device]\nserial = "A1"\n[site]\nlatitude_deg = 50.45\nheight_m = 170.0']
    for alpha, beta, start, end in windows:
        angles = f"alpha_deg = {np.rad2deg(alpha)}\nbeta_deg = {np.rad2deg(beta)}"
        lines_.append(f"[[position]]\n{angles}\nstart_s = {start}\nend_s = {end}")
    (folder / "session.toml").write_text("\n".join(lines_) + "\n")
    if taken_at:
        began = datetime.fromisoformat(taken_at).timestamp()
        (folder / MARKS).write_text(mark_line({"event": "told", "host_s": began}))
    return Session.open(folder)


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session of 3 March with its result; whoever writes into it makes a copy."""
    folder = tmp_path_factory.mktemp("solved") / "s"
    bench(folder, "2026-03-03T12:00:00Z")
    assert main(["solve", str(folder)]) in (0, 1)
    return folder


def test_old_values_do_not_enter_a_new_calibration(tmp_path: Path) -> None:
    session = bench(tmp_path / "s")
    found = solve(observe(session)[0], level_sigma_deg=0.001)
    still = usable_windows(session)
    clean = assess(found, session, still, BOUNDS, None)
    near = [float(found.value("acc_bias.x"))] * 3
    like_it = filled(tmp_path / "n.sqlite", *near)
    poisoned = filled(tmp_path / "h.sqlite", *[1e6] * 9)
    decisions = []
    for history in (like_it, poisoned):
        with_it = assess(found, session, still, BOUNDS, history)
        assert np.array_equal(with_it.values, clean.values)
        assert np.array_equal(with_it.covariance, clean.covariance)
        decisions.append(with_it.info["decision"])
    go, no_go = decisions
    assert go["go"] and not no_go["go"]
    assert any("acc_bias x differs from 9 earlier" in r for r in no_go["reasons"])


def test_later_runs_are_no_earlier_ones(tmp_path: Path, solved: Path) -> None:
    session = Session.open(shutil.copytree(solved, tmp_path / "s"))
    found = solve(observe(session)[0], level_sigma_deg=0.001)
    found = with_provenance(found, session.about)
    still = usable_windows(session)
    near = [float(found.value("acc_bias.x"))] * 3
    history = filled(tmp_path / "h.sqlite", *near, *[1e6] * 9)
    made = assess(found, session, still, BOUNDS, history)
    assert made.info["decision"]["go"]
    assert made.info["taken_at"] == "2026-03-03T12:00:00+00:00"
    page = write_report(session.folder, history=tmp_path / "h.sqlite").read_text()
    assert "2026-03-03" in page and "2026-03-04" not in page
    moved = session.folder.rename(tmp_path / "moved")
    history.add("2026-03-03T12:00:00+00:00", session.folder, found)
    page = write_report(moved, history=tmp_path / "h.sqlite").read_text()
    assert "4 calibrations;" in page, "it is no earlier one of itself"


def test_a_history_that_is_away_costs_no_report(
    tmp_path: Path, solved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    away = "postgresql://lab@127.0.0.1:1/imus"
    session = Session.open(shutil.copytree(solved, tmp_path / "s"))
    assert "Residuals" in write_report(session.folder, history=away).read_text()
    said = capsys.readouterr().err
    assert said.startswith(f"fieldcal: report without earlier calibrations: {away}")
    found = with_provenance(solve(observe(session)[0]), session.about)
    told = store_in_history(History(away), session, found)
    assert f"once that is mended, fieldcal batch {session.folder} puts it" in told


def test_a_session_of_unknown_time_counts_as_the_newest_and_says_so(
    tmp_path: Path,
) -> None:
    session = bench(tmp_path / "s", "")
    found = solve(observe(session)[0], level_sigma_deg=0.001)
    found = with_provenance(found, session.about)
    still = usable_windows(session)
    alone = assess(found, session, still, BOUNDS, History(tmp_path / "none"))
    assert not any("is unknown" in w for w in alone.warnings)
    history = filled(tmp_path / "h.sqlite", *[1e6] * 9)
    made = assess(found, session, still, BOUNDS, history)
    assert any("as if it were the newest" in w for w in made.warnings)
    assert not made.info["decision"]["go"] and made.info["taken_at"] is None
    assert store_in_history(history, session, made) == ""
    assert history.runs("A1")[0].taken_at == ""


def test_calibrations_of_unknown_time_are_listed_and_left_out_of_the_plot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    history, picture = History(tmp_path / "h.sqlite"), tmp_path / "p.png"
    own = ["history", "A1", "--history", str(tmp_path / "h.sqlite")]
    history.add(None, Path("/s/unknown"), calibration(0.2))
    assert main(own[:1] + own[2:]) == 0
    assert "the last at an unknown time" in capsys.readouterr().out
    assert main([*own, "--png", str(picture)]) == 2
    assert "no calibration has a time" in capsys.readouterr().err
    filled(tmp_path / "h.sqlite", 0.2, 0.21)
    assert main([*own, "--png", str(tmp_path / "gone" / "p.png")]) == 2
    assert "written: the folder is not there: make it" in capsys.readouterr().err
    assert main([*own, "--png", str(picture)]) == 0
    said = capsys.readouterr()
    assert "1 of unknown time left out" in said.err and picture.exists()
    assert "  1 ?          " in said.out
    assert main([*own, "--compare", "1", "2"]) == 0
    assert "1: at an unknown time," in capsys.readouterr().out


def test_only_runs_that_were_go_or_accepted_are_the_family(tmp_path: Path) -> None:
    history = filled(tmp_path / "h.sqlite", 0.2, 0.2, 0.2)
    history.add("2026-03-04", Path("/s/4"), calibration(0.9, go=False))
    history.add("2026-03-05", Path("/s/5"), calibration(0.9))
    runs = history.runs("A1")
    assert [r.number for r in family_runs(runs)] == [1, 2, 3, 5]
    history.accept("A1", 4)
    assert [r.number for r in family_runs(history.runs("A1"))] == [4, 5]
    with pytest.raises(InputError, match="has no calibration number 77"):
        history.accept("A1", 77)


def test_a_run_out_of_family_is_flagged_and_the_next_is_not(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    history = filled(tmp_path / "h.sqlite", *(0.2 + 0.01 * rng.standard_normal(12)))
    history.add("2026-03-20", Path("/s/x"), calibration(1.0, go=False))
    history.add("2026-03-21", Path("/s/y"), calibration(0.2))
    points = parameter_trend(history.runs("A1"), "acc_bias.x", BOUNDS)
    assert [p.run.number for p in points if p.out_of_family] == [13]
    assert 0.01 < points[-1].spread < 0.05
    shown = trend_lines(points)
    assert max(map(len, shown)) <= 80
    assert [i for i, line in enumerate(shown) if line.endswith("OUT")] == [12]
    columns = [line.index("o", line.index("|")) for line in shown]
    assert np.argmax(columns) == 12, "the plot shows it to the right"


def test_what_is_compared_with_nothing_is_not_in_family(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A parameter without a limit jumps, and a single run stands alone."""
    store = tmp_path / "h.sqlite"
    history = History(store)
    call = ["history", "A1", "--history", str(store), "--parameter"]
    for day, offset in enumerate((0.1, 9.0), 1):
        one = calibration(0.2)
        names = ("angle_offset.alpha0_deg", *one.names[1:])
        values = np.array([offset, *one.values[1:]])
        both = replace(one, names=names, values=values)
        history.add(f"2026-03-0{day}", Path(f"/s/{day}"), both)
        if day == 1:
            assert main([*call, one.names[1]]) == 0
            out = capsys.readouterr().out
            assert "nothing to compare with" in out and "in family" not in out
    assert main([*call, "angle_offset.alpha0_deg"]) == 0
    out = capsys.readouterr().out
    assert "not judged" in out and "nan" not in out and "in family" not in out


def test_the_command_lists_plots_compares_and_accepts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "h.sqlite"
    filled(path, 0.2, 0.21, 0.9)
    own = ["--history", str(path)]
    assert main(["history", *own]) == 0
    assert "A1: 3 calibrations" in capsys.readouterr().out
    picture = tmp_path / "bias.png"
    pytest.importorskip("matplotlib")
    assert main(["history", "A1", *own, "--png", str(picture)]) == 0
    assert "acc_bias.x, m/s²" in capsys.readouterr().out
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["history", "A1", *own, "--compare", "1", "3", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["changed"] == ["acc_bias.x"]
    assert main(["history", "A1", *own, "--accept", "3", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [r["accepted"] for r in document["runs"]] == [False, False, True]
    assert document["parameters"]["acc_bias.x"][2]["out_of_family"]
    for wrong in (["B2"], ["A1", "--parameter", "x"], ["A1", "--compare", "1", "9"]):
        assert main(["history", *wrong, *own]) == 2
    capsys.readouterr()
    assert main(["history", "--compare", "1", "3", *own]) == 2
    shown = capsys.readouterr()
    assert "--compare is about one device: name it" in shown.err and not shown.out


def test_the_report_shows_what_the_history_of_the_device_has(
    tmp_path: Path, solved: Path
) -> None:
    folder = shutil.copytree(solved, tmp_path / "s")
    filled(tmp_path / "h.sqlite", 0.2, 0.21)
    page = write_report(folder, history=tmp_path / "h.sqlite").read_text()
    assert "2026-03-01" in page and "2026-03-02" in page
    alone = write_report(folder, history=tmp_path / "none.sqlite").read_text()
    assert "2026-03-01" not in alone
