"""The documentation: its examples are run, its commands and drawings checked."""

import argparse
import doctest
import re
import sys
import tomllib
from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import get_args
from xml.etree import ElementTree

import numpy as np
import pytest
from bench import five_positions

import fieldcal
from fieldcal.calibration import wording
from fieldcal.cli import COMMANDS
from fieldcal.core.positions import POSITION_SETS, Position
from fieldcal.diagnosis.result import Verdict
from fieldcal.effects import catalogue
from fieldcal.session.folder import Session
from fieldcal.sim_device.vocabulary import parse

DOCS = Path(__file__).parent.parent / "docs"


@pytest.fixture
def bench_7(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder to stand in, with a session of five positions on a tilted base."""
    monkeypatch.chdir(tmp_path)
    five_positions(tmp_path / "bench-7")


def with_examples(paths: Iterable[Path]) -> list[Path]:
    """Files in which doctest finds something; it takes its time also where not."""
    return sorted(p for p in paths if ">>>" in p.read_text(encoding="utf-8"))


@pytest.mark.usefixtures("bench_7")
@pytest.mark.parametrize("page", with_examples(DOCS.glob("*.md")), ids=lambda p: p.stem)
def test_examples_of_the_documentation(page: Path) -> None:
    failed, tried = doctest.testfile(str(page), module_relative=False)
    assert tried and failed == 0


def test_examples_of_every_module() -> None:
    folders = ("fieldcal", "drivers", "procedures", "sim_device")
    paths = [p for f in folders for p in (DOCS.parent / f).rglob("*.py")]
    some = with_examples(paths)
    names = {str(p.relative_to(DOCS.parent).with_suffix("")) for p in some}
    failed: dict[str, doctest.TestResults] = {}
    for name in sorted(names):
        dotted = name.replace("/", ".").removesuffix(".__init__")
        if not dotted.startswith("fieldcal"):
            dotted = f"fieldcal.{dotted}"
        result = doctest.testmod(import_module(dotted))
        failed |= {dotted: result} if result.failed else {}
    assert not failed


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the site's drawings are made."""
    monkeypatch.setattr(sys, "path", [str(DOCS), *sys.path])


def options(command: str) -> set[str]:
    parser = argparse.ArgumentParser()
    module = import_module(f"fieldcal.commands.{COMMANDS[command][1]}")
    module.add_arguments(parser)
    text = parser.format_help()
    return set(re.findall(r"(?<![\w-])-{1,2}[a-z][\w-]*", text))


PAGES = [*DOCS.glob("*.md"), DOCS.parent / "README.md"]


@pytest.mark.parametrize("page", sorted(PAGES), ids=lambda p: p.stem)
def test_every_command_line_that_is_shown_has_options_that_exist(page: Path) -> None:
    lines = re.findall(r"^fieldcal (\w+)(.*)$", page.read_text(), re.MULTILINE)
    for command, rest in lines:
        assert command in COMMANDS
        # what stands in quotation marks belongs to somebody else
        bare = re.sub(r'"[^"]*"', "", re.split(r" #| &&", rest)[0])
        named = set(re.findall(r"(?<!\S)-{1,2}[a-z][\w-]*", bare))
        assert named <= options(command), (command, rest)


def test_the_session_that_is_shown_can_be_read(tmp_path: Path) -> None:
    page = (DOCS / "files.md").read_text()
    toml = re.search(r"```toml\n(.*?)```", page, re.DOTALL)
    assert toml and tomllib.loads(toml[1])["format"] == 1
    (tmp_path / "session.toml").write_text(toml[1])
    assert Session.open(tmp_path).positions[0].degrees == (0.0, 0.0)


@pytest.mark.usefixtures("drawn")
def test_drawings_of_positions_turn_the_axes_as_the_frames_say() -> None:
    positions = import_module("drawn.positions")
    for positions_of in POSITION_SETS.values():
        page = positions.drawings(positions_of)
        assert len(list(ElementTree.fromstring(page))) == len(positions_of)
    ends = {}
    for name, position in (("home", (0, 0)), ("half", (180, 0)), ("up", (0, 90))):
        page = positions.drawings([Position.deg(*position)])
        found = re.findall(r'<text x="([\d.-]+)" y="([\d.-]+)"[^>]*>(\w)<', page)
        ends[name] = {axis: np.array([float(x), float(y)]) for x, y, axis in found}
    centre = np.array([positions.WIDTH, positions.HEIGHT]) / 2
    # y is down at home, and up after half a turn about z
    assert (
        ends["home"]["y"][1] > centre[1] + 40 and ends["half"]["y"][1] < centre[1] - 40
    )
    assert abs(ends["home"]["y"][0] - centre[0]) < 1
    assert (
        ends["home"]["x"][0] > centre[0] + 40 and ends["half"]["x"][0] < centre[0] - 40
    )
    # f = A (0, -g, 0) has +g along z at beta = 90 deg, so z points up
    assert ends["up"]["z"][1] < centre[1] - 40


@pytest.mark.usefixtures("drawn")
@pytest.mark.thorough
def test_the_screens_that_are_shown_are_those_of_a_run_that_ends_in_go() -> None:
    screens = import_module("drawn.screens").screens()
    said = {
        name: " ".join(
            " ".join(ElementTree.fromstring(svg).itertext())
            .replace("\xa0", " ")
            .split()
        )
        for name, svg in screens.items()
    }
    assert "T U R N T O α = 22.5°, β = 0°" in said["turning"]
    assert "H O L D S T I L L" in said["averaging"]
    assert "base tilt about x" in said["result"] and "GO: within" in said["result"]
    # a site that needs no network
    assert not any(re.search(r"url\(\W*http|href", svg) for svg in screens.values())


@pytest.mark.usefixtures("drawn")
def test_the_picture_of_each_effect_is_one_the_virtual_device_can_make() -> None:
    pytest.importorskip("matplotlib")
    effects = import_module("drawn.effects")
    for effect in catalogue().values():
        assert parse(effects.given(effect)).id == effect.id
    for name in ("cross_coupling", "quantisation", "clock_skew"):
        svg = effects.picture(catalogue()[name])
        assert svg.lstrip().startswith("<?xml") and svg.count("<path") > 10


@pytest.mark.usefixtures("drawn")
def test_drawings_of_installations_turn_as_the_page_says() -> None:
    """α > 0 lets the east side go down, β > 0 the north end up."""
    made = import_module("drawn.installations")
    page = (DOCS / "installing.md").read_text()
    assert set(re.findall(r"installation_(\w+)\.html", page)) == set(made.INSTALLATIONS)

    def ends(alpha: float, beta: float) -> dict[str, float]:
        one = replace(made.INSTALLATIONS["bare"], turned=(alpha, beta))
        home, turned = re.findall(r"<figure.*?</figure>", made.drawings(one))
        label = r'<text x="[\d.-]+" y="([\d.-]+)"[^>]*>(\w)<'
        heights = (
            {n: float(y) for y, n in re.findall(label, f)} for f in (home, turned)
        )
        before, then = heights
        return {name: then[name] - before[name] for name in before}

    assert ends(20, 0)["x"] > 10, "down on the page is further down"
    assert ends(0, 20)["z"] < -10


CODE = Path(fieldcal.__file__).parent
ROOMS = {path.parent.name for path in CODE.glob("*/__init__.py")}


@pytest.mark.parametrize(
    "page", sorted([*PAGES, DOCS.parent / "CONTRIBUTING.md"]), ids=lambda p: p.stem
)
def test_each_module_that_is_named_exists(page: Path) -> None:
    for room, module in re.findall(r"`(?:fieldcal/)?(\w+)/(\w+)`", page.read_text()):
        if room in ROOMS:
            place = CODE / room / module
            assert place.is_dir() or place.with_suffix(".py").is_file(), place


def test_each_room_is_named_where_the_rooms_are_described() -> None:
    table = (DOCS.parent / "CONTRIBUTING.md").read_text()
    assert set(re.findall(r"`(\w+)/`", table)) >= ROOMS


@pytest.mark.usefixtures("drawn")
def test_the_drawing_of_the_architecture_has_rooms_that_exist() -> None:
    architecture = import_module("drawn.architecture")
    named = {n for n, box in architecture.BOXES.items() if not box.outside}
    assert named <= ROOMS
    # those that all others use stand in the text beside it, the command line above it
    assert ROOMS - named == {
        *("core", "calibration", "planning", "twin", "commands", "noise", "against"),
        *("fleet", "service", "thermal", "navigator"),
    }
    ends = {end for start, to, _ in architecture.ARROWS for end in (start, to)}
    assert ends == set(architecture.BOXES)
    texts = {e.text for e in ElementTree.fromstring(architecture.drawing()).iter()}
    assert texts >= {box.title for box in architecture.BOXES.values()}


@pytest.mark.usefixtures("drawn")
def test_the_glossary_has_each_term_that_results_and_screens_use() -> None:
    terms = {
        term.lower()
        for line in re.findall(r"^(\S.*)\n: ", (DOCS / "glossary.md").read_text(), re.M)
        for term in line.split(", ")
    }
    verdicts = {verdict.replace("_", " ") for verdict in get_args(Verdict)}
    groups = {re.sub(r"^(acc|gyro) ", "", title) for title in wording.TITLES.values()}
    assert verdicts | groups - {"joints' offset"} | {"go", "no-go"} <= terms
