"""Plans: refused before anything moves, and turned by what they name."""

from __future__ import annotations

import argparse
import json
import re
import tomllib
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import parse

import numpy as np
import pytest
import tomlkit
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from processes import HANGS, script, steady

from fieldcal import procedures
from fieldcal.cli import main
from fieldcal.commands.run import add_arguments
from fieldcal.commands.run_task import make_task
from fieldcal.core.errors import PlanError
from fieldcal.run import plan_file
from fieldcal.run.command_mover import CommandMover
from fieldcal.run.movers import VirtualMover

POSITIONS = [{"alpha_deg": 0.0, "beta_deg": 0.0}, {"alpha_deg": 45.0, "beta_deg": 5.0}]
TABLE = {"alpha_deg": 0.0, "beta_deg": 0.0, "rate_deg_s": [20.0, 0.0, 0.0]}


def plan(**run: Any) -> dict[str, Any]:
    return {"position": POSITIONS, "run": run}


def test_the_schema_is_one() -> None:
    schema = plan_file.plan_schema()
    Draft202012Validator.check_schema(schema)
    assert set(schema["required"]) <= set(schema["properties"])


def test_a_whole_plan_is_taken() -> None:
    mover = {"kind": "command", "command": ["tt", "{alpha}", "{beta}"], "timeout_s": 9}
    task = plan_file.task_from_tables(
        plan(seconds=20, verify=True, mover=mover, device="serial:/dev/x"), "p.toml"
    )
    assert task.seconds == 20.0 and task.procedure == "positions"
    assert len(task.positions) == 3 and task.verification is not None
    own = {**plan(), "verification": {"alpha_deg": 10.0, "beta_deg": 1.0}}
    named = plan_file.task_from_tables(own, "p.toml").verification
    assert named is not None and named.degrees == (10.0, 1.0)


@pytest.mark.parametrize("name", procedures.procedure_names())
def test_a_procedure_brings_its_positions(name: str) -> None:
    task = plan_file.task_from_tables({"run": {"procedure": name}}, "plan.toml")
    taken = [p.degrees for p in task.about.positions]
    assert taken == [p.degrees for p in procedures.load_procedure(name).POSITIONS]


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        (plan(seconds=-1), "[run] seconds = -1 cannot be: give the averaging time"),
        (plan(seconds="30"), '[run] seconds = "30" cannot be'),
        (plan(second=30), "[run] second is not known: there are procedure, seconds"),
        (plan(device="ttyUSB0"), "[run] device = "),
        (
            plan(further=["can:can0"], further_serial=["B1", "C1"]),
            "'C1' is the serial number of no device: give --serial no more often",
        ),
        (
            plan(device="can:can0", further=["can:can0"]),
            "device 'can:can0' is named tw",
        ),
        (
            plan(further=["can:0", "can:1"], further_serial=["B1", "B1"]),
            "serial number 'B1' is named twice: name it once",
        ),
        (plan(mover={}), "[run.mover] kind is missing: write a table [run.mover]"),
        (plan(mover={"kind": "crane"}), "write nothing, command or virtual"),
        (plan(mover={"kind": "command"}), "command is missing"),
        (
            plan(mover={"kind": "nothing", "command": ["x"]}),
            "[run.mover] command does not belong there: leave it out, or write",
        ),
        (
            plan(mover={"kind": "command", "command": ["x", "{delta}"]}),
            "{delta} is none of alpha, beta, gamma, position, name",
        ),
        (
            plan(mover={"kind": "command", "command": ["x", "{"]}),
            "is none of alpha, beta",
        ),
        (plan(mover={"kind": "virtual", "options": "'"}), "[run.mover] options"),
        (plan(mover={"kind": "virtual", "control": "/x"}), "[run] device is missing"),
        (
            {"run": {}, "position": [POSITIONS[0], {"alpha_deg": 900, "beta_deg": 0}]},
            "[[position]] number 2 alpha_deg = 900 cannot be: give an angle in degrees",
        ),
        (
            {"run": {}, "position": [{"alpha_deg": 1}]},
            '{"alpha_deg": 1} cannot be: give alpha_deg and beta_deg, rotation',
        ),
        ({"run": {}, "position": POSITIONS[:1] * 3}, "are the same"),
        ({"run": {}}, "are not enough"),
        (
            {**plan(procedure="two_position"), "position": [*POSITIONS, POSITIONS[0]]},
            'is for 2 positions, not 3: write procedure = "positions"',
        ),
        (
            {"run": {}, "position": [*POSITIONS, TABLE]},
            "number 3 has rate_deg_s, and a run holds",
        ),
        (
            {**plan(), "verification": {"alpha_deg": 1}},
            "[verification] beta_deg is miss",
        ),
        ({**plan(), "site": {"gravity": 0.0}}, "gravity = 0"),
    ],
)
def test_a_wrong_plan_is_refused_with_file_key_and_remedy(
    tables: dict[str, Any], says: str
) -> None:
    with pytest.raises(PlanError) as error:
        plan_file.task_from_tables(tables, "p.toml")
    assert str(error.value).startswith("p.toml: ") and says in str(error.value)


def test_all_faults_of_a_plan_are_told_at_once() -> None:
    wrong = {
        **plan(seconds=0.5, device="serial", verify="yes"),
        "site": {"latitude_deg": 500, "level": 0.01},
    }
    with pytest.raises(PlanError) as error:
        plan_file.task_from_tables(wrong, "p.toml")
    said = str(error.value).split("; and ")
    assert len(said) == 5
    for key in ("seconds = 0.5", 'device = "serial"', "verify", "latitude_deg = 500"):
        assert sum(key in one for one in said) == 1
    assert "[site] level is not known: write level_deg" in said


def test_what_is_too_much_to_read_is_counted() -> None:
    wrong = {
        "run": {f"key{i}": 1 for i in range(3)},
        "format": 2,
        "position": [{}] * 12,
    }
    with pytest.raises(PlanError, match=r"; and \d more$"):
        plan_file.task_from_tables(wrong, "p.toml")


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"positions": POSITIONS}, "positions is not known: write position"),
        ({"position": {"alpha": 1.0}}, "[position] alpha is not known: write alpha_"),
        ({"rum": {"seconds": 9.0}}, "rum is not known: write run"),
        (
            {"site": {"latitude": 50.0}},
            "[site] latitude is not known: write latitude_d",
        ),
        (
            {"position": [POSITIONS[0], {**POSITIONS[1], "beta": 1.0}]},
            "[[position]] number 2 beta is not known: write beta_deg",
        ),
        # written above the first table, it would state nothing
        ({"latitude_deg": 50.0}, "write latitude_deg below [site]"),
        ({"level": 0.01}, "level belongs into a table: write level_deg below [site]"),
        ({"warm_up_s": 9.0}, "write warm_up_s below [run]"),
    ],
)
def test_a_misspelt_key_is_no_key_of_ones_own(
    tables: dict[str, Any], says: str
) -> None:
    """A plan with [[positions]] was carried out at the positions of its procedure."""
    with pytest.raises(PlanError) as error:
        plan_file.task_from_tables({**plan(), **tables}, "p.toml")
    assert says in str(error.value)
    own = {**plan(), "notes": "mine", "name": "mine", "site": {"town": "Kyiv"}}
    assert plan_file.task_from_tables(own, "p.toml").about.raw["notes"] == "mine"


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text(max_size=9), inner, max_size=3)
    ),
    max_leaves=6,
)
KEYS = st.sampled_from(
    ["run", "position", "site", "frame", "device", "nominal", "verification", "format"]
    + ["seconds", "mover", "kind", "alpha_deg", "beta_deg", "procedure", "sigma"]
)


@given(st.dictionaries(KEYS, ANYTHING | st.dictionaries(KEYS, ANYTHING), max_size=5))
def test_whatever_a_plan_says_it_is_taken_or_refused(tables: dict[str, Any]) -> None:
    for whole in (tables, {**plan(), **tables}):
        try:
            task = plan_file.task_from_tables(whole, "p.toml")
        except PlanError as error:
            assert str(error).startswith("p.toml: ")
        else:
            assert len(task.about.positions) >= 2


CALLER = """\
import sys
from fieldcal.sim_device.remote import RemoteDevice
with RemoteDevice({control!r}) as device:
    device.turn(float(sys.argv[2]), float(sys.argv[3]))
if sys.argv[1] == {fails!r}:
    sys.exit("the table is jammed")
"""


def run(folder: Path, device: VirtualMover, fails: str, junit: Path, *more: str) -> int:
    call = script(folder, CALLER.format(control=device.control, fails=fails))
    mover = {"kind": "command", "command": call, "timeout_s": HANGS}
    tables = {
        "device": {"squareness": 1e-5},
        "site": {
            "latitude_deg": 50.45,
            "height_m": 170.0,
            "level_deg": 0.001,
            "angle_setting_deg": 0.001,
        },
        **plan(
            seconds=8.0,
            device=f"serial:{device.port}?format=witmotion",
            mover=mover,
            procedure="two_position",
        ),
    }
    path = folder / "plan.toml"
    path.write_text(tomlkit.dumps(tables))
    session = folder / "s"
    return main(
        ["run", str(path), "--headless", "--json", "--no-report", "-o", str(session)]
        + ["--junit", str(junit), *more]
    )


def test_a_night_without_an_operator(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A plan, a turntable's command, a result and what CI reads of it."""
    junit = tmp_path / "run.xml"
    sim = ["--serial", "witmotion", "--speed", "20", "--acc-noise=0.005,0.005,0.005"]
    with VirtualMover([*sim, *steady(tmp_path)], False) as device:
        assert run(tmp_path, device, "", junit) == 0
        said = capsys.readouterr()
        truth = device.truth
    result = json.loads(said.out)
    off = result["parameters"]["acc_bias"]["value"][0] - truth["acc_bias"][0]
    assert abs(off) < 4.5 * result["parameters"]["acc_bias"]["sigma"][0]
    events = [json.loads(line)["event"] for line in said.err.splitlines()]
    assert events.count("place") == 2 and events.count("taken") == 2
    suite = parse(junit).getroot()
    assert suite.get("failures") == suite.get("errors") == "0"
    names = [case.get("name", "") for case in suite.iter("testcase")]
    assert names[0] == "1: α = 0°, β = 0°" and "gyr_bias uncertainty" in names
    assert main(["solve", str(tmp_path / "s"), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)["parameters"]
    assert again.keys() == result["parameters"].keys()
    for group, found in result["parameters"].items():
        for key, close in (("value", 1e-9), ("sigma", 1e-6)):
            one, two = (np.array(f[key], float) for f in (again[group], found))
            np.testing.assert_allclose(one, two, rtol=close, atol=1e-12)


def test_a_turntable_that_jams_ends_the_run_with_3(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    junit = tmp_path / "run.xml"
    with VirtualMover(["--serial", "witmotion", "--speed", "20"], False) as device:
        assert run(tmp_path, device, "2", junit, "--patience=0") == 3
    said = capsys.readouterr().err
    assert "the table is jammed" in said and "--resume" in said
    suite = parse(junit).getroot()
    assert suite.get("failures") == suite.get("errors") == "1"
    (error,) = suite.iter("error")
    assert "jammed" in error.get("message", "")


def parsed(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return parser.parse_args(arguments)


def test_what_options_say_goes_over_the_plan(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    path.write_text(tomlkit.dumps({"site": {"latitude_deg": 50.0}, **plan()}))
    said = ["--latitude", "60", "--serial", "A1", "--level", "0.1"]
    about = make_task(parsed(str(path), *said))[0].about
    assert about.latitude_deg == 60.0 and about.device["serial"] == "A1"
    assert about.level_deg == 0.1
    said = ["--device", "can:0", "--device", "can:1", "--device", "can:2"]
    task, _ = make_task(parsed(str(path), *said, "--serial", "A1", "--serial", "B1"))
    assert task.run["device"] == "can:0" and task.about.device["serial"] == "A1"
    assert task.further == {"can:1": "B1", "can:2": ""}
    about = make_task(parsed(str(path)))[0].about
    assert about.latitude_deg == 50.0 and about.level_deg is None


def test_the_plan_of_the_readme_is_one() -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text("utf-8")
    blocks = re.findall(r"```toml\n(.*?)```", readme, re.DOTALL)
    assert len(blocks) == 1
    assert (
        len(plan_file.task_from_tables(tomllib.loads(blocks[0]), "README.md").positions)
        == 5
    )


def test_a_position_may_be_one_finite_turn() -> None:
    """A third of a turn about the space diagonal, said twice."""
    turns = [
        {"rotation_vector_deg": [120 / 3**0.5] * 3},
        {"quaternion": [0.5, 0.5, 0.5, 0.5]},
    ]
    made = plan_file.task_from_tables(
        {**plan(), "position": [*POSITIONS, *turns]}, "p.toml"
    )
    one, other = made.positions[-2:]
    assert one.all_degrees == pytest.approx(other.all_degrees, abs=1e-6)
    with pytest.raises(PlanError, match="rotation_vector_deg or quaternion"):
        half = [*POSITIONS, {"alpha_deg": 10.0}]
        plan_file.task_from_tables({**plan(), "position": half}, "p.toml")


def test_a_third_angle_wants_somebody_who_turns_it() -> None:
    third = [*POSITIONS, {"alpha_deg": 10.0, "beta_deg": 5.0, "gamma_deg": 30.0}]

    def of(**mover: Any) -> plan_file.PlanTask:
        run = {"mover": mover} if mover else {}
        return plan_file.task_from_tables({"position": third, "run": run}, "p.toml")

    assert of().positions[2].all_degrees == (10.0, 5.0, 30.0)  # by hand
    whole = of(kind="command", command=["tt", "{alpha}", "{beta}", "{gamma}"])
    turned = CommandMover(whole.mover["command"], 1.0)
    assert turned._filled_command(whole.positions[2], 2) == ["tt", "10", "5", "30"]
    of(kind="command", command=["tt", "{alpha}", "{beta}", "g={gamma:.2f}"])
    with pytest.raises(PlanError, match=r"write \{gamma\}"):
        of(kind="command", command=["tt", "{alpha}", "{beta}"])
    assert of(kind="virtual").positions[2].gamma
