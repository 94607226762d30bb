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
from fieldcal.report.browser import Browser, find_browser
from fieldcal.report.charts import Axis, Chart, Series
from fieldcal.report.overview import PageHeader
from fieldcal.report.page import render_page

ERRORS = ("Runtime.exceptionThrown", "Log.entryAdded", "Runtime.consoleAPICalled")
RECORD = "document.querySelector('#record .canvas')"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if find_browser() is None:
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
        assert main(["solve", str(session), "--as-printed"]) == 0
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
        browser.call("Input.dispatchKeyEvent", type="keyDown", key=key)
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
    top = PageHeader("a device with a long name", "", "noise", "", "said " * 99,
               NameValues(()))  # fmt: skip
    page = folder / "band.html"
    page.write_text(render_page(top, [Section("allan", "Allan", (figure,))]), "utf-8")
    opened(browser, page)
    band = "document.querySelector('.canvas .cover').getBBox()"
    line = "document.querySelector('.canvas .line').getBBox()"
    assert browser.value(f"{band}.height") > browser.value(f"{line}.height") > 0
    assert browser.value("document.querySelector('h1').offsetWidth") > 250


def drag(browser: Browser, start: int, end: int, down: int = 0) -> None:
    """Drag over the recording from one x to another, and down; CSS pixels."""
    y = height_of(browser, RECORD)
    for kind, x, by in (
        ("Pressed", start, 0),
        ("Moved", end - 9, down - 1),
        ("Moved", end, down),
        ("Released", end, down),
    ):
        left = {"button": "left", "buttons": 1, "clickCount": 1}
        place = {"x": x, "y": y + by}
        browser.call("Input.dispatchMouseEvent", type=f"mouse{kind}", **place, **left)


def height_of(browser: Browser, canvas: str) -> float:
    """Where on the screen the first panel of a figure is, once it is in view."""
    browser.value(f"{canvas}.scrollIntoView({{block: 'center'}})")
    return float(browser.value(f"{canvas}.getBoundingClientRect().top")) + 50


def ticks(browser: Browser) -> list[str]:
    """What is written beside the recording and below it."""
    found: list[str] = browser.value(
        f"[...{RECORD}.querySelectorAll('text')].map(t => t.textContent)"
    )
    return found


def test_a_panel_is_zoomed_in_height_and_given_back(
    browser: Browser, folder: Path
) -> None:
    opened(browser, own(folder))
    whole, before = view(browser), ticks(browser)
    drag(browser, 500, 502, down=30)
    assert view(browser) == whole, "drawn downwards it keeps the stretch of time"
    high = ticks(browser)
    changed = [a for a, b in zip(before, high, strict=False) if a != b]
    assert changed and high[-8:] == before[-8:], "the first panel, not the last one"
    drag(browser, 500, 560, down=20)
    assert view(browser)[1] - view(browser)[0] < (whole[1] - whole[0]) / 4
    browser.value("document.querySelector('#record .tools button:last-child').click()")
    assert view(browser) == pytest.approx(whole) and ticks(browser) == before


def two_of_one_clock(folder: Path) -> Path:
    """Two figures over the same time, and one over another quantity."""
    t = np.arange(5.0)
    bias = Series("bias", t, 1.5 * t, 1, "both", 1.5 * t - 1, 1.5 * t + 1)
    model = Series("model", t, np.full(5, 100.0), 2, "line")
    time, value = Axis("time", "s"), Axis("bias", "mm/s²")
    charts = [
        Chart("one", "One", "", time, value, (bias, model)),
        Chart("two", "Two", "", time, value, (bias,)),
        Chart("three", "Three", "", Axis("τ", "s"), value, (bias,)),
    ]
    top = PageHeader("a device", "", "noise", "", "said", NameValues(()))
    page = folder / "clock.html"
    figures = tuple(Figure(c, "") for c in charts)
    page.write_text(render_page(top, [Section("all", "All", figures)]), "utf-8")
    return page


def test_a_cursor_reads_every_figure_of_the_same_clock(
    browser: Browser, folder: Path
) -> None:
    opened(browser, two_of_one_clock(folder))
    canvas = "document.querySelector('#one .canvas')"
    middle = browser.value(f"{canvas}.getBoundingClientRect().left") + 66 + 500
    y = height_of(browser, canvas)
    browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=middle, y=y)
    read = [
        browser.value(f"document.querySelector('#{n} .readout').textContent")
        for n in ("one", "two", "three")
    ]
    assert read[0].splitlines() == [
        "time 2 s", "bias  3 (2 … 4) mm/s²", "model  100 mm/s²",
    ]  # fmt: skip
    assert read[1].splitlines() == ["time 2 s", "bias  3 (2 … 4) mm/s²"]
    assert read[2] == "", "another quantity"
    box = "document.querySelector('#one .readout').getBoundingClientRect()"
    assert 0 < browser.value(f"{box}.left") - middle < 40, "beside the cursor"


def test_a_legend_takes_a_curve_away_and_gives_it_back(
    browser: Browser, folder: Path
) -> None:
    opened(browser, two_of_one_clock(folder))
    lines = "document.querySelectorAll('#one .canvas .line').length"
    top = "document.querySelector('#one .canvas').textContent"
    before = browser.value(top)
    assert browser.value(lines) == 2
    for there in (1, 2):
        browser.value("document.querySelectorAll('#one .legend button')[1].click()")
        view_of = "new Promise(r => requestAnimationFrame(() => setTimeout(r, 20)))"
        browser.value(view_of)
        assert browser.value(lines) == there
        assert (browser.value(top) == before) == (there == 2), "the scale goes by it"


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
