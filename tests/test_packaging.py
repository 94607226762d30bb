"""What a wheel and a fresh clone hold."""

import re
import tomllib
from pathlib import Path

from fieldcal.cli import COMMANDS
from fieldcal.effects import catalogue
from fieldcal.sim_device import effects

ROOT = Path(__file__).parent.parent
PARTS = ["fieldcal", "drivers", "procedures", "sim_device"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def test_pyproject_lists_every_package() -> None:
    inits = [i for part in PARTS for i in (ROOT / part).rglob("__init__.py")]
    found = {".".join(i.parent.relative_to(ROOT).parts) for i in inits}
    found = {p if p.startswith("fieldcal") else f"fieldcal.{p}" for p in found}
    found = {
        p for p in found if not re.match(r"fieldcal\.(fieldcal|drivers\.drivers)", p)
    }
    assert set(PROJECT["tool"]["setuptools"]["packages"]) == found


def test_the_three_folders_are_linked_where_tools_look_for_them() -> None:
    for part in PARTS[1:]:
        link = ROOT / "fieldcal" / part
        assert link.is_symlink() and link.readlink() == Path("..") / part


def test_every_dependency_is_pinned() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()[1:]
    pinned = {line.split("==")[0].lower().replace("_", "-") for line in lines}
    wanted = list(PROJECT["project"]["dependencies"])
    for extra in PROJECT["project"]["optional-dependencies"].values():
        wanted += extra
    names = {re.split(r"[<>=\[ ]", w)[0].lower() for w in wanted} - {"fieldcal"}
    assert names <= pinned


def test_the_readme_names_only_commands_that_are_there() -> None:
    text = (ROOT / "README.md").read_text()
    named = set(re.findall(r"^fieldcal (\w+)", text, re.MULTILINE))
    assert named and named <= set(COMMANDS)


def test_the_virtual_device_can_be_given_every_effect_of_the_catalogue() -> None:
    assert set(catalogue()) <= set(effects.ids())
