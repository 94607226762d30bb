"""Writing parameters to a virtual autopilot: right, wrong, and taken back."""

from __future__ import annotations

import json
import pty
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("fastcrc")
pytest.importorskip("pymavlink")

from processes import FIELDCAL, simulated

from fieldcal.calibration import Calibration, Nominal
from fieldcal.cli import main
from fieldcal.commands.write import change_table, propose_changes
from fieldcal.core.errors import InputError, SessionError
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import ARDUPILOT, PX4, parameter_names
from fieldcal.drivers.mavlink_parameters import ParameterLink
from fieldcal.install.proposal import changes, problems
from fieldcal.session.file_writing import write_atomically
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder

BIAS, SCALE = (0.2, -0.3, 0.1), (1.006, 0.992, 1.008)
GYR = (0.011, -0.02, 0.006)


@contextmanager
def autopilot(query: str = "") -> Iterator[str]:
    """A virtual autopilot that is asked for parameters only; its address."""
    with simulated("--mavlink", f"tcpin:127.0.0.1:0?{query}") as (place, _):
        yield f"mavlink:{place}?system=1&component=1"


def installed(
    autopilot: int = ARDUPILOT, taken_out: bool = False
) -> InstalledCalibration:
    known = parameter_names(autopilot, 0)
    values = dict.fromkeys((*known["acc_offset"], *known["gyr_offset"]), 0.05)
    values |= dict.fromkeys(known["acc_scale"], 1.02)
    values |= dict.fromkeys(known["rotation"], 0.0)
    return InstalledCalibration(autopilot, 0, values, taken_out)


def calibration(go: bool = True) -> Calibration:
    groups = {"acc_bias": BIAS, "acc_scale": SCALE, "gyr_bias": GYR}
    units = {"acc_bias": "m/s^2", "acc_scale": "1", "gyr_bias": "rad/s"}
    return Calibration(
        "joint",
        tuple(f"{g}.{a}" for g in groups for a in "xyz"),
        np.concatenate([np.array(v) for v in groups.values()]),
        np.diag(np.repeat([1e-6, 1e-8, 1e-10], 3)),
        tuple(units[g] for g in groups for _ in "xyz"),
        5.0,
        7,
        1e-3,
        info={"decision": {"go": go, "reasons": [] if go else ["too warm"]}},
    )


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """A solved session that was recorded from an autopilot."""
    return make(tmp_path / "s", calibration(), installed())


def make(folder: Path, found: Calibration, there: InstalledCalibration) -> Path:
    folder.mkdir()
    (folder / "session.toml").write_text("format = 1\n")
    mark = {"event": "device", "installed": there.as_table()}
    (folder / "marks.jsonl").write_text(json.dumps(mark) + "\n")
    (folder / "result.json").write_text(json.dumps(found.to_json()))
    return folder


def old_query(there: InstalledCalibration) -> str:
    return "&".join(f"{k}={v}" for k, v in there.values.items())


@given(
    st.sampled_from([ARDUPILOT, PX4]),
    st.booleans(),
    st.lists(st.floats(-2, 2), min_size=6, max_size=6),
    st.lists(st.floats(0.9, 1.1), min_size=6, max_size=6),
)
def test_what_is_installed_takes_all_of_it_out(
    program: int, taken_out: bool, offsets: list[float], scales: list[float]
) -> None:
    """The sensor's own output, through the new parameters, is the true force."""
    o, k = np.array(offsets[:3]), np.array(scales[:3])
    true, raw_bias, raw_scale = np.array([1.0, -9.8, 0.3]), offsets[3:], scales[3:]
    raw = raw_bias + np.array(raw_scale) * true
    there = installed(program, taken_out)
    known = parameter_names(program, 0)
    there.values |= dict(zip(known["acc_offset"], o.tolist(), strict=True))
    there.values |= dict(zip(known["acc_scale"], k.tolist(), strict=True))
    # what was sent is (r - o) k, unless it was taken out for the recording
    gain, zero = (np.ones(3), np.zeros(3)) if taken_out else (k, o)
    bias, scale = (np.array(raw_bias) - zero) * gain, np.array(raw_scale) * gain
    found = calibration()
    values = np.concatenate([bias, scale, np.array(GYR)])
    found = Calibration(
        "joint", found.names, values, found.covariance, found.units, 0.0, 0, 0.0
    )
    new = {c.name: c.new for c in changes(found, Nominal(), there)}
    offset, factor = (
        np.array([new[n] for n in known[w]]) for w in ("acc_offset", "acc_scale")
    )
    np.testing.assert_allclose((raw - offset) * factor, true, atol=1e-9)


@pytest.mark.parametrize("taken_out", [False, True])
def test_what_was_not_determined_is_kept_as_the_table_says(taken_out: bool) -> None:
    """Without gyroscopes, and without the scale factor of z."""
    found, there = calibration(), installed(taken_out=taken_out)
    keep = [i for i, n in enumerate(found.names) if n[:3] == "acc" and n[-3:] != "e.z"]
    few = replace(
        found,
        names=tuple(found.names[i] for i in keep),
        values=found.values[keep],
        covariance=found.covariance[np.ix_(keep, keep)],
        units=tuple(found.units[i] for i in keep),
    )
    wanted = changes(few, Nominal(), there)
    kept = [line for line in change_table(wanted).splitlines() if "kept" in line]
    assert len(kept) == 4
    for c in wanted:
        if any(line.startswith(c.name) for line in kept):
            assert c.new == pytest.approx(c.old, abs=1e-12), c


def test_the_uncertainty_of_a_parameter_is_that_of_many_calibrations() -> None:
    rng, found = np.random.default_rng(1), calibration()
    drawn = rng.multivariate_normal(found.values, found.covariance, 1500)
    there = installed()
    new = np.array(
        [
            [c.new for c in changes(_with(found, values), Nominal(), there)]
            for values in drawn
        ]
    )
    sigma = [c.sigma for c in changes(found, Nominal(), there)]
    np.testing.assert_allclose(new.std(axis=0), sigma, rtol=0.06)


def _with(found: Calibration, values: np.ndarray) -> Calibration:
    return Calibration(
        "joint", found.names, values, found.covariance, found.units, 0.0, 0, 0.0
    )


@pytest.mark.parametrize(("kind", "program"), [("ardupilot", ARDUPILOT), ("px4", PX4)])
def test_written_read_back_and_undone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str, program: int
) -> None:
    there = installed(program)
    folder = make(tmp_path / "s", calibration(), there)
    wanted = {c.name: c.new for c in changes(calibration(), Nominal(), there)}
    with autopilot(f"autopilot={kind}&{old_query(there)}") as url:
        assert main(["write", str(folder), "--device", url, "--yes", "--json"]) == 0
        said = json.loads(capsys.readouterr().out)
        assert {p["name"]: p["new"] for p in said["parameters"]} == wanted
        with ParameterLink(url.removeprefix("mavlink:")) as link:
            kept = link.read(wanted)
        np.testing.assert_allclose(
            list(kept.values()), list(wanted.values()), rtol=1e-6
        )
        assert main(["undo", str(folder), "--yes"]) == 0
        with ParameterLink(url.removeprefix("mavlink:")) as link:
            kept = link.read(wanted)
        old = [there.values[n] for n in wanted]
        np.testing.assert_allclose(list(kept.values()), old, rtol=1e-6)
        assert main(["undo", str(folder), "--yes"]) == 2


def test_a_full_disk_says_what_the_autopilot_has(
    session: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Before anything is written, and behind it, where it would seem to have failed."""
    room = [0]

    def write(path: Path, text: str) -> Path:
        room[0] -= 1
        if room[0] < 0:
            raise SessionError(f"{path}: cannot be written: the disk is full")
        return write_atomically(path, text)

    monkeypatch.setattr("fieldcal.install.transaction.write_atomically", write)
    there = installed()
    with autopilot(old_query(there)) as url:
        for command, before, behind in (
            ("write", "nothing was written to", "all 9 parameters are written and"),
            ("undo", "nothing was given back to", "all 9 parameters are given back"),
        ):
            call = [command, str(session), "--device", url, "--yes"]
            for files, said in ((0, before), (1, behind)):
                room[0] = files
                assert main(call) == 2
                assert f"the disk is full; {said}" in capsys.readouterr().err


def test_how_to_undo_is_told_as_a_shell_takes_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    there = installed()
    folder = make(tmp_path / "bench 7", calibration(), there)
    with autopilot(old_query(there)) as url:
        assert main(["write", str(folder), "--device", url, "--yes"]) == 0
    assert f"undo '{folder}' --device '{url}'" in capsys.readouterr().err


def test_a_parameter_that_is_not_taken_is_noticed_and_all_is_undone(
    session: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("fieldcal.drivers.mavlink_parameters.ROUNDS", 2)
    there = installed()
    with autopilot(f"drop=INS_ACCOFFS_Y&{old_query(there)}") as url:
        assert main(["write", str(session), "--device", url, "--yes"]) == 3
        said = capsys.readouterr().err
        assert "INS_ACCOFFS_Y = 0.05" in said and "undone, all 9 are as before" in said
        with ParameterLink(url.removeprefix("mavlink:")) as link:
            kept = link.read(there.values)
    for name, value in there.values.items():
        assert kept[name] == pytest.approx(value, rel=1e-6), name


def test_parameters_kept_wrongly_once_are_noticed_and_set_again(session: Path) -> None:
    there = installed()
    fault = "glitch=INS_ACCSCAL_X,INS_GYROFFS_Z"
    wanted = {c.name: c.new for c in changes(calibration(), Nominal(), there)}
    with autopilot(f"{fault}&{old_query(there)}") as url:
        assert main(["write", str(session), "--device", url, "--yes"]) == 0
        with ParameterLink(url.removeprefix("mavlink:")) as link:
            kept = link.read(wanted)
    np.testing.assert_allclose([*kept.values()], [*wanted.values()], rtol=1e-6)


def test_what_cannot_be_undone_is_said_with_the_values(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    there = installed()
    with autopilot(f"alter=INS_ACCSCAL_Y&{old_query(there)}") as url:
        assert main(["write", str(session), "--device", url, "--yes"]) == 3
    said = capsys.readouterr().err
    assert "could not be undone" in said and "INS_ACCSCAL_Y = 1.02" in said


def test_no_go_is_not_written_unless_forced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = make(tmp_path / "s", calibration(go=False), installed())
    out = tmp_path / "new.param"
    assert main(["write", str(folder), "-o", str(out)]) == 1
    assert "NO-GO" in (said := capsys.readouterr().err) and "too warm" in said
    assert not out.exists()
    assert main(["write", str(folder), "-o", str(out), "--force"]) == 0
    assert "INS_ACCOFFS_X," in out.read_text()


def test_what_is_bad_is_not_written_whatever_was_decided(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = replace(calibration(), good=False, warnings=("two axes are swapped",))
    folder = make(tmp_path / "s", bad, installed())
    assert main(["write", str(folder), "-o", str(tmp_path / "new.param")]) == 1
    assert "two axes are swapped" in capsys.readouterr().err


def test_parameters_changed_since_the_recording_are_not_written_over(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with autopilot() as url:
        assert main(["write", str(session), "--device", url, "--yes"]) == 2
    assert "somebody has changed it" in capsys.readouterr().err


def test_nobody_there_to_be_asked(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ours, theirs = pty.openpty()
    with autopilot(old_query(installed())) as url:
        call = [*FIELDCAL, "write", str(session)]
        done = subprocess.run(
            [*call, "--device", url], stdin=subprocess.DEVNULL, capture_output=True
        )
        assert done.returncode == 2 and b"give --yes" in done.stderr
        with subprocess.Popen(
            [*call, "--device", url], stdin=theirs, stderr=subprocess.PIPE
        ) as asked:
            with open(ours, "w", closefd=False) as terminal:
                terminal.write("n\n")
            _, said = asked.communicate()
        assert asked.returncode == 1 and b"as you wished" in said
        assert not list(session.glob("installed-before*"))


def test_values_that_no_sensor_has_are_named() -> None:
    found = calibration()
    wild = np.array([9.0, 0, 0, 2.0, 1, 1, 0, 0, 0])
    there = installed(taken_out=True)
    said = problems(changes(_with(found, wild), Nominal(), there), there)
    assert len(said) == 2 and "INS_ACCOFFS_X = 9" in said[0]
    assert "INS_ACCSCAL_X = 0.5" in said[1]


def test_a_session_of_no_autopilot_is_refused(tmp_path: Path) -> None:
    about = {"format": 1, "device": {"name": "bench"}, "sampling": {"rate_hz": 100.0}}
    with Recorder(tmp_path / "s", about) as recorder:
        recorder.mark("device", serial="7")
    with pytest.raises(InputError, match="not recorded from an autopilot"):
        propose_changes(Session.open(tmp_path / "s"), calibration())


@pytest.mark.parametrize("scale", [float("nan"), 0.0, -1.0])
def test_a_damaged_installed_scale_is_said_and_never_built_on(scale: float) -> None:
    there = installed()
    name = parameter_names(ARDUPILOT, 0)["acc_scale"][1]
    there.values[name] = scale
    assert name in there.remark and "set it anew" in there.remark
    with pytest.raises(InputError, match=name):
        there.parameters_after(np.array(BIAS), np.array(SCALE), np.array(GYR))
    json.dumps(there.as_table(), allow_nan=False)
    again = InstalledCalibration.from_table(there.as_table())
    assert again.missing == ([name] if np.isnan(scale) else [])
