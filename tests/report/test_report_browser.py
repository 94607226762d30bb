"""The report in a browser: drawn, zoomable, quiet, on paper; skipped without one."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from bench import five_positions
from observed import SHARED
from test_report import HOSTILE

from fieldcal.cli import main
from fieldcal.report.blocks import Figure, NameValues, Section
from fieldcal.report.browser import Browser, find
from fieldcal.report.charts import Axis, Chart, Series
from fieldcal.report.overview import Head
from fieldcal.report.page import rendered

ERRORS = ("Runtime.exceptionThrown", "Log.entryAdded", "Runtime.consoleAPICalled")
RECORD = "document.querySelector('#record .canvas')"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if find() is None:
        pytest.skip("no Chromium here to look at the page with")
    with Browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pages")


def practice(folder: Path, name: str, code: int) -> Path:
    source = SHARED / "practice" / name
    if not source.is_dir():
        pytest.skip(f"the practice session is not here: {source}")
    session = folder / name
    session.mkdir(exist_ok=True)
    for file in source.iterdir():
        shutil.copyfile(file, session / file.name)
    main(["solve", str(session)])
    assert main(["diagnose", str(session), "--report"]) == code
    return session / "report.html"


def own(folder: Path) -> Path:
    """Five positions of a device whose name is a script, with an earlier session."""
    session = folder / "own"
    if not session.exists():
        five_positions(session, {"device": {"name": HOSTILE}})
        assert main(["solve", str(session)]) == 0
        assert main(["report", str(session), "--earlier", str(session)]) == 0
    return session / "report.html"


def consistent(folder: Path) -> Path:
    return practice(folder, "p01", 0)


def left_out(folder: Path) -> Path:
    return practice(folder, "p05", 1)


def real(folder: Path) -> Path:
    source = SHARED / "real" / "mikoff_mpu9150_x5" / "imu0.log.gz"
    if not source.is_file():
        pytest.skip(f"the recording is not here: {source}")
    session = folder / "imu0"
    options = ["--rate", "100", "--gravity", "9.81", "--still", "2.5"]
    columns = ["--columns", "ax,ay,az,gx,gy,gz"]
    main(["import", str(source), *columns, *options, "-o", str(session)])
    assert main(["solve", str(session), "--cross"]) == 0
    assert main(["report", str(session)]) == 0
    return session / "report.html"


def opened(browser: Browser, page: Path) -> None:
    """Open a page; whatever it complains about fails the test."""
    browser.resize(1200, 900)
    browser.open(page)
    assert [e for e in browser.events if e[0] in ERRORS] == []
    asked = [p["request"]["url"] for m, p in browser.events if m.endswith("WillBeSent")]
    assert [url for url in asked if not url.startswith("file:")] == []


def view(browser: Browser) -> tuple[float, float]:
    """What the recording shows, after the next frame."""
    browser.value("new Promise(r => requestAnimationFrame(() => setTimeout(r, 20)))")
    found = browser.value(f"[{RECORD}.dataset.from, {RECORD}.dataset.to].map(Number)")
    return (found[0], found[1])


@pytest.mark.parametrize(
    "make",
    [
        own,
        *(
            pytest.param(m, marks=pytest.mark.thorough)
            for m in (consistent, left_out, real)
        ),
    ],
)
def test_every_plot_is_drawn_and_can_be_zoomed(
    browser: Browser, folder: Path, make: Callable[[Path], Path]
) -> None:
    opened(browser, make(folder))
    figures = browser.value("document.querySelectorAll('figure.plot').length")
    assert figures >= 5
    empty = "[...document.querySelectorAll('figure.plot')].filter(f => !f.querySelector"
    assert browser.value(f"{empty}('.canvas path, .canvas .point')).length") == 0
    lines = (
        f"[...{RECORD}.querySelectorAll('path')].map(p => p.getAttribute('d').length)"
    )
    assert min(browser.value(lines)) > 500
    whole = view(browser)
    browser.value(f"{RECORD}.focus()")
    for key in ("+", "+", "ArrowRight"):
        browser.ask("Input.dispatchKeyEvent", type="keyDown", key=key)
    near = view(browser)
    assert near[1] - near[0] == pytest.approx((whole[1] - whole[0]) / 4)
    drag(browser, 400, 460)
    close = view(browser)
    assert near[0] < close[0] < close[1] < near[1]
    assert browser.value(f"{RECORD}.dataset.raw") == "true"
    shown = "document.querySelector('#record .fineness').textContent"
    assert browser.value(shown) == "Every sample is shown."
    assert min(browser.value(lines)) > 20
    browser.value("document.querySelector('#record .tools button:last-child').click()")
    assert view(browser) == pytest.approx(whole)


def test_the_band_of_a_model_is_drawn_about_its_line(
    browser: Browser, folder: Path
) -> None:
    """However few points it has: that of what the noise of a device will be."""
    tau = np.array([0.1, 1.0, 10.0])
    model = Series("model", tau, 1 / tau, 1, "line", 0.5 / tau, 2 / tau)
    axes = Axis("τ", "s", log=True), Axis("σ", "rad/s", log=True)
    figure = Figure(Chart("allan", "Allan deviation", "", *axes, (model,)), "")
    top = Head("a device with a long name", "", "noise", "", "said " * 99,
               NameValues(()))  # fmt: skip
    page = folder / "band.html"
    page.write_text(rendered(top, [Section("allan", "Allan", (figure,))]), "utf-8")
    opened(browser, page)
    band = "document.querySelector('.canvas .cover').getBBox()"
    line = "document.querySelector('.canvas .line').getBBox()"
    assert browser.value(f"{band}.height") > browser.value(f"{line}.height") > 0
    assert browser.value("document.querySelector('h1').offsetWidth") > 250


def drag(browser: Browser, start: int, end: int) -> None:
    """Drag over the recording from one x to another, CSS pixels."""
    browser.value(f"{RECORD}.scrollIntoView({{block: 'center'}})")
    y = browser.value(f"{RECORD}.getBoundingClientRect().top") + 100
    for kind, x in (
        ("Pressed", start),
        ("Moved", end - 9),
        ("Moved", end),
        ("Released", end),
    ):
        down = {"button": "left", "buttons": 1, "clickCount": 1}
        browser.ask("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, **down)


def test_hostile_names_do_nothing_and_break_nothing(
    browser: Browser, folder: Path
) -> None:
    opened(browser, own(folder))
    assert browser.value("typeof hacked") == "undefined"
    assert browser.value("document.querySelector('h1').textContent") == HOSTILE


def test_it_fits_a_phone_and_can_be_filed(browser: Browser, folder: Path) -> None:
    opened(browser, own(folder))
    browser.resize(390, 844, mobile=True)
    assert browser.value("document.documentElement.scrollWidth") == 390
    assert browser.value(f"{RECORD}.firstChild.viewBox.baseVal.width") < 390
    assert browser.pdf().startswith(b"%PDF")
    assert browser.png().startswith(b"\x89PNG")
