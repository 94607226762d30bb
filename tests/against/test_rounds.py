"""A simulator that is a command: run, patched, and run again."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import sitl_like
from session_folders import write_session
from strapdown import GRAVITY, schedule

from fieldcal.against import rounds as module
from fieldcal.against.opening import read_output
from fieldcal.against.result import (
    Difference,
    Facts,
    Match,
    RealAndSimulated,
    SimulatorPrediction,
)
from fieldcal.against.rounds import run_and_patch
from fieldcal.against.sensor_model import SensorModel, patch_model
from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.diagnosis.result import Quantity

TESTS = Path(__file__).parent.parent
DEVICE = {
    "SIM_ACC1_BIAS_X": 0.05, "SIM_ACC1_BIAS_Z": -0.1, "SIM_ACC1_SCAL_Y": 0.996,
    "SIM_GYR1_BIAS_Y": 0.002,
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    table = sitl_like.outputs(DEVICE, 3)
    none = np.full(len(table), np.nan)
    block = Block.of(table[:, 0], table[:, 1:4], table[:, 4:], none, none, none)
    there = tmp_path_factory.mktemp("rounds") / "real"
    return write_session(there, block, schedule(), site={"gravity": GRAVITY})


def test_sitl_is_patched_until_it_agrees(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", f"{TESTS}:{TESTS.parent}")
    command = f"{sys.executable} {TESTS / 'sitl_like.py'} {{patch}} {{out}}"
    call = ["diagnose", str(folder), "--against", command, "--patch", "sitl"]
    assert main(call) == 0
    said = capsys.readouterr()
    assert "run 0: acc bias, " in said.err and "run 1, patched: nothing" in said.err
    found = sitl_like.read(folder / "patch.parm")
    for name, value in DEVICE.items():
        assert found[name] == pytest.approx(value, abs=2e-3), name
    assert not [p for p in folder.iterdir() if p.name.startswith(".patch")]


def unread(path: Path) -> tuple[Match, list[str]]:
    """What a simulator wrote that should not have come to be compared."""
    read_output(path)
    raise AssertionError(path)


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("import sys; sys.exit('no licence')", "exit code 1; it said: no licence"),
        ("pass", "wrote nothing to {out}"),
        ("import sys; open(sys.argv[2], 'w').write('a,b\\n')", "out"),
    ],
)
def test_what_a_simulator_that_fails_says_is_told(code: str, told: str) -> None:
    command = f'{sys.executable} -c "{code}" {{patch}} {{out}}'
    with pytest.raises(InputError) as error:
        run_and_patch(command, unread, 50.0, "json", 1, lambda *_: None)
    assert told in str(error.value)


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("simulate {out}", "has no {patch}"),
        ("no-such-program {patch} {out}", "cannot be started"),
        ("simulate 'half {patch} {out}", "is no command"),
    ],
)
def test_a_command_that_is_none_is_refused(command: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        run_and_patch(command, unread, 50.0, "json", 1, lambda *_: None)


def pair(real: float, sim: float, unit: str) -> RealAndSimulated:
    def q(value: float) -> Quantity:
        return Quantity(value, 1e-6, unit)

    return RealAndSimulated(q(real), q(sim), q(real - sim))


def differing(*differences: Difference) -> Match:
    nothing = SimulatorPrediction(0.0, 0.0, 1.0)
    facts = Facts(100.0, np.nan, np.nan, 5.0, 20.0, {})
    return Match(
        "left_out", 1.0, differences, (), nothing, nothing, facts, facts, (), ""
    )  # fmt: skip


def test_what_a_format_has_nothing_for_ends_the_rounds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    even = {"z": pair(3e-4, 0.0, "1/(m/s^2)")}
    given = differing(Difference("quadratic", "left_out", 1.0, even))
    monkeypatch.setattr(module, "_run_and_compare", lambda *_: (given, []))
    for form, runs in (("px4", 1), ("json", 4)):
        done = run_and_patch(
            "sim {patch} {out}", unread, 50.0, form, 3, lambda *_: None
        )
        assert len(done) == runs and done[-1].patch.changed == ("quadratic",)


def test_what_a_simulator_has_beyond_its_parameters_is_made_up_for() -> None:
    """A bias of 0.02 that is built in, and noise of 3 beside which 4 make 5."""

    def compared(bias: float, noise: float) -> Match:
        return differing(
            Difference("acc_bias", "resized", 1.0, {"x": pair(0.1, bias, "m/s^2")}),
            Difference("noise", "resized", 1.0, {"ax": pair(5.0, noise, "m/s^2")}),
        )

    first = patch_model(compared(0.02, 3.0), SensorModel(rate_hz=100.0))
    assert first.calibration["acc_bias"][0] == pytest.approx(0.1)
    built_in = first.calibration["acc_bias"][0] + 0.02
    then = patch_model(
        compared(built_in, float(np.hypot(first.noise["ax"], 3.0))), first
    )
    assert then.calibration["acc_bias"][0] + 0.02 == pytest.approx(0.1)
    assert np.hypot(then.noise["ax"], 3.0) == pytest.approx(5.0)


def test_effects_of_the_recording_come_in_and_those_of_the_simulator_go_out() -> None:
    step = {"ax": pair(0.1, 0.0, "m/s^2"), "at_s": pair(65.0, 0.0, "s")}
    even = {
        "z": RealAndSimulated(None, Quantity(3e-4, 1e-6, ""), Quantity(-3e-4, 1e-6, ""))
    }
    found = patch_model(
        differing(
            Difference("bias_step", "left_out", 1.0, step),
            Difference("quadratic", "added", 1.0, even),
        )
    )
    assert found.effects["bias_step"] == {"ax": pytest.approx(0.1), "at_s": 60.0}
    assert found.effects["quadratic"]["z"] == pytest.approx(0.0)
    assert found.changed == ("bias_step", "quadratic")
