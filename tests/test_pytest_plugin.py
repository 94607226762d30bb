"""What others get to test with: the plugin, as their own project meets it."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parent / "example_project"


@pytest.mark.parametrize(
    ("chosen", "passed"),
    [
        ("not five_positions", 5),
        pytest.param("five_positions", 1, marks=pytest.mark.thorough),
    ],
)
def test_the_example_project_passes_with_the_plugin_that_pytest_found(
    chosen: str, passed: int
) -> None:
    call = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    call += ["-k", chosen]
    done = subprocess.run(
        [*call, "--rootdir", str(EXAMPLE), "-c", str(EXAMPLE / "pyproject.toml")],
        cwd=EXAMPLE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{passed} passed" in done.stdout


def test_whoever_does_not_use_it_does_not_pay_for_it() -> None:
    (entry,) = [e for e in entry_points(group="pytest11") if e.name == "fieldcal"]
    code = (
        f"import sys, pytest, {entry.value}\n"
        "heavy = {'numpy', 'scipy', 'pyarrow', 'rich', 'serial'} & set(sys.modules)\n"
        "ours = [m for m in sys.modules if m.startswith('fieldcal.')]\n"
        "sys.exit(str([*heavy, *ours]) if heavy or len(ours) > 3 else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
