"""What others get to test with: the plugin, as their own project meets it."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

EXAMPLE = Path(__file__).parent / "example_project"


def test_the_example_project_passes_with_the_plugin_that_pytest_found() -> None:
    call = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*call, "--rootdir", str(EXAMPLE), "-c", str(EXAMPLE / "pyproject.toml")],
        cwd=EXAMPLE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "5 passed" in done.stdout


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
