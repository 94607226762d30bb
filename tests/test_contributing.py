"""The diffs of CONTRIBUTING.md, applied to a copy of the tree: what they add runs."""

import configparser
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fieldcal.core.gravity import normal_gravity
from fieldcal.session.folder import Session
from fieldcal.sim_device import Profile

ROOT = Path(__file__).parent.parent
CODE = ("fieldcal", "drivers", "procedures", "sim_device", "benchmarks", "tests")
TREE = (*CODE, "pyproject.toml")
ADDED = {
    "tests/effects/test_effects.py": "temperature_curve or TemperatureCurve",
    "tests/sim_device/test_sim_effects.py": "temperature_curve",
    "tests/benchmarks_check/test_concealed_sessions.py": "temperature_curve or kind",
    "tests/drivers/test_wires_meet.py": "logger or writes",
}
"""Tests that walk what there is, and what they are to find there."""

DIAGNOSED = ("tests/diagnosis/test_diagnosis_contract.py", "temperature_curve")
"""The same, where each that is found is diagnosed."""


def diffs() -> list[str]:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return re.findall(r"^```diff\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the tree with everything added that CONTRIBUTING.md adds."""
    root = tmp_path_factory.mktemp("additions")
    for name in TREE:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, root / name, symlinks=True)
        else:
            shutil.copy(ROOT / name, root)
    for diff in diffs():
        apply = ["git", "apply", "--whitespace=error-all", "-"]
        subprocess.run(apply, input=diff, text=True, cwd=root, check=True)
    return root


def ran(root: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python with the fieldcal of the copy."""
    there = {**os.environ, "PYTHONPATH": str(root)}
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=root, env=there, capture_output=True, text=True, check=False
    )


def said(root: Path, *arguments: str) -> str:
    """What a command of the copy says."""
    done = ran(root, "-m", "fieldcal", *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_what_is_added_is_new_files_alone() -> None:
    heads = re.findall(r"^--- (\S+)\n\+\+\+ b/(\S+)$", "".join(diffs()), re.MULTILINE)
    assert heads and {old for old, _ in heads} == {"/dev/null"}
    assert not [new for _, new in heads if (ROOT / new).exists()]


# most effects are left out of the circle without --all
PYTEST = ("-m", "pytest", "-q", "--all", "-p", "no:cacheprovider")


def test_the_tests_that_walk_what_there_is_find_what_was_added(tree: Path) -> None:
    chosen = " or ".join(f"({words})" for words in ADDED.values())
    done = ran(tree, *PYTEST, "-rA", "-k", chosen, *ADDED)
    assert done.returncode == 0, done.stdout
    for file in ADDED:
        assert f"PASSED {file}" in done.stdout, file


@pytest.mark.thorough
def test_an_effect_that_was_added_is_diagnosed(tree: Path) -> None:
    file, name = DIAGNOSED
    done = ran(tree, *PYTEST, "-rA", "-k", name, file)
    assert done.returncode == 0, done.stdout
    assert f"PASSED {file}::test_put_in_and_named[{name}]" in done.stdout


def test_a_command(tree: Path) -> None:
    assert "say how strong gravity is at a place" in said(tree, "--help")
    g = float(said(tree, "gravity", "50.45", "170").split()[0])
    assert g == pytest.approx(normal_gravity(50.45, 170.0), abs=1e-5)


@pytest.mark.thorough
def test_a_procedure_and_an_exporter(tree: Path, tmp_path: Path) -> None:
    session, out = tmp_path / "session", tmp_path / "out.ini"
    how = ["--virtual", "--speed", "20", "--seconds", "2", "--headless", "--json"]
    where = ["-o", str(session), "--history", str(tmp_path / "history.db")]
    done = ran(tree, "-m", "fieldcal", "run", "six_faces", *how, *where, "--no-report")
    assert done.returncode in (0, 1) and done.stdout, done.stderr
    found = json.loads(done.stdout)["parameters"]
    assert {"acc_bias", "acc_scale", "gyr_bias"} <= set(found)
    said(tree, "export", str(session), "--format", "ini", "-o", str(out))
    written = configparser.ConfigParser()
    written.read(out)
    bias = [float(v) for v in written["accelerometer"]["bias"].split()]
    assert bias == pytest.approx(Profile().truth.acc_bias, abs=0.01)


def test_an_importer(tree: Path, tmp_path: Path) -> None:
    six = {"acc": [0.1, -9.8, 0.2], "gyr": [0.0, 0.0, 0.0]}
    lines = [json.dumps({"t": i / 100, **six}) for i in range(500)]
    recording, session = tmp_path / "log.jsonl", tmp_path / "bench-7"
    recording.write_text("\n".join(lines))
    said(tree, "import", str(recording), "-o", str(session))
    block = Session.open(session).block
    assert block.six.tolist() == [[*six["acc"], *six["gyr"]]] * 500
