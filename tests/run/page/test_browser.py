"""The page in a real browser, on screens of a phone and of a tablet."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, radians, sin

import numpy as np
import pytest
from browser import Screen
from scipy.spatial.transform import Rotation

from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.drivers.driver import LinkHealth
from fieldcal.planning.steps import Hold
from fieldcal.report.browser import find_browser
from fieldcal.run.operator.protocol import OperatorView
from fieldcal.run.page.board import Board
from fieldcal.run.page.server import PageServer
from fieldcal.run.position_check import PositionCheck
from fieldcal.run.wait_reason import WaitReason, WaitState

pytestmark = pytest.mark.skipif(
    find_browser() is None, reason="there is no Chromium to show the page in"
)

PHONE, TABLET, SMALL = (390, 844), (1180, 820), (320, 568)
WORDS = "document.getElementById('words')?.textContent"


@pytest.fixture(scope="module")
def page() -> Iterator[Screen]:
    with Screen() as made:
        yield made


@pytest.fixture
def server() -> Iterator[PageServer]:
    with PageServer("127.0.0.1") as made:
        made.board = Board("fieldcal · five_position", FIVE_POSITIONS)
        made.board.position_asked(Hold(1, FIVE_POSITIONS[1], 30.0))
        yield made


def opened(page: Screen, server: PageServer) -> None:
    page.go(server.address)
    page.until(f"{WORDS} === 'TURN TO'")


def tap(page: Screen, what: str) -> None:
    page.value(f"document.querySelector({what!r}).click()")


@pytest.mark.parametrize("size", [PHONE, TABLET])
def test_it_shows_what_to_do_on_any_screen(
    page: Screen, server: PageServer, size: tuple[int, int]
) -> None:
    server.board.sentence_told("<b>not carried out</b> " + "x" * 300)
    page.size(*size)
    opened(page, server)
    assert page.text("angles") == FIVE_POSITIONS[1].name
    assert page.text("detail") == "position 2 of 5, then let go"
    assert "<b>not carried out</b>" in page.text("told")
    assert page.value("location.search") == ""  # the token is not kept in sight
    assert "token" not in str(page.value("document.cookie"))
    # nothing runs off to the side, what is pressed with gloves is large
    assert page.value("document.documentElement.scrollWidth <= innerWidth")
    assert page.value("document.getElementById('take').offsetHeight") >= 48
    large = "parseFloat(getComputedStyle(document.getElementById('words')).fontSize)"
    assert page.value(large) > 40


def test_what_is_wrong_is_seen_on_a_small_phone(
    page: Screen, server: PageServer
) -> None:
    """Nobody scrolls with a device in both hands; no button runs off to the side."""
    server.board.sentence_told("it has not been turned yet")
    page.size(*SMALL)
    opened(page, server)
    told = "document.getElementById('told').getBoundingClientRect()"
    stage = "document.getElementById('stage').getBoundingClientRect()"
    page.until(f"{told}.height > 0 && {told}.bottom <= {stage}.top")
    tap(page, "#take")
    page.until("document.getElementById('mine').hidden", False)
    right = "[...document.querySelectorAll('#mine button')].at(-1)"
    assert page.value(f"{right}.getBoundingClientRect().right <= innerWidth - 8")


def test_a_third_angle_turns_the_box_about_its_own_vertical_axis(
    page: Screen, server: PageServer
) -> None:
    """East, down, south are x, y, -z; clockwise from above turns east to south."""
    position = Position.deg(20.0, 10.0, gamma=120.0)
    hold = Hold(len(FIVE_POSITIONS), position, 30.0)  # found on the way
    server.board.position_asked(hold)
    opened(page, server)
    script = "turned(20, 10, 120).slice(9, -1).split(',').map(Number)"
    m = page.value(script)
    turned = Rotation.from_euler("ZXY", [20.0, 10.0, 120.0], degrees=True).as_matrix()
    flip = np.diag([1.0, 1.0, -1.0])
    seen = np.array([m[0:3], m[4:7], m[8:11]]).T
    np.testing.assert_allclose(seen, flip @ turned @ flip, atol=1e-5)
    page.until("document.getElementById('angles').textContent", position.name)
    there = PositionCheck(False, 12.0, 10.0, "", 2.0)
    server.board.view_changed(
        OperatorView("turning", hold, there, 0.4, 0.0, np.full(6, np.nan),
                     WaitReason(WaitState.TURNING), 100.0, 24.5, LinkHealth(samples=9))
    )  # fmt: skip
    row = "document.querySelector('#joints tbody').rows[2]"
    page.until(f"{row}.hidden", False)
    page.until(f"{row}.cells[2].textContent", "+120.0°")


@pytest.mark.parametrize(("alpha", "beta"), [(22.5, 2.5), (-45.0, 90.0)])
def test_the_box_stands_as_the_position_says(
    page: Screen, server: PageServer, alpha: float, beta: float
) -> None:
    """Of the box at home, east to the right, down, and towards who looks north."""
    opened(page, server)
    script = f"turned({alpha}, {beta}, 0).slice(9, -1).split(',').map(Number)"
    m = page.value(script)
    east, down, south = m[0:3], m[4:7], m[8:11]
    a, b = radians(alpha), radians(beta)
    # alpha: its east side goes down; beta: its north side goes up
    assert east == pytest.approx([cos(a), sin(a), 0.0], abs=1e-5)
    assert down[1] == pytest.approx(cos(a) * cos(b), abs=1e-5)
    assert south == pytest.approx([-sin(a) * sin(b), cos(a) * sin(b), cos(b)], abs=1e-5)


def test_it_is_dark_where_the_screen_is(page: Screen, server: PageServer) -> None:
    ground = (
        "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)"
    )
    page.size(*PHONE)
    opened(page, server)
    light = sum(page.value(ground))
    page.size(*PHONE, dark=True)
    assert sum(page.value(ground)) < 150 < light
    page.size(*PHONE)


def test_buttons_are_taken_pressed_and_pressed_twice(
    page: Screen, server: PageServer
) -> None:
    opened(page, server)
    assert page.value("document.getElementById('mine').hidden")
    tap(page, "#take")
    page.until("document.getElementById('mine').hidden", False)
    tap(page, "[data-wish=repeat]")
    page.until("document.getElementById('theirs').hidden")
    while (wish := server.buttons.pressed()) is None:
        page.value("0")
    assert wish == "repeat"
    tap(page, "[data-wish=skip]")
    shown = "document.querySelector('[data-wish=skip]').textContent"
    assert page.value(shown) == "Really leave out?"
    assert server.buttons.pressed() is None
    tap(page, "[data-wish=skip]")
    while (wish := server.buttons.pressed()) is None:
        page.value("0")
    assert wish == "skip"
    assert server.buttons.take("other", over=True)
    page.until("document.getElementById('mine').hidden")
    assert "take them over" in page.text("take")


def test_a_tap_for_a_position_that_was_taken_leaves_out_no_other_one(
    page: Screen, server: PageServer
) -> None:
    """Its second tap comes while the next position is asked for."""
    opened(page, server)
    tap(page, "#take")
    page.until("!document.getElementById('mine').hidden")
    tap(page, "[data-wish=skip]")
    server.board.position_asked(Hold(2, FIVE_POSITIONS[2], 30.0))
    page.until("document.getElementById('detail').textContent.startsWith('position 3')")
    tap(page, "[data-wish=skip]")
    shown = "document.querySelector('[data-wish=skip]').textContent"
    assert page.value(shown) == "Really leave out?"
    tap(page, "[data-wish=repeat]")
    while (wish := server.buttons.pressed()) is None:
        page.value("0")
    assert wish == "repeat"


def test_a_link_that_is_lost_comes_back(page: Screen, server: PageServer) -> None:
    opened(page, server)
    lost = "!document.getElementById('lost').hidden"
    assert not page.value(lost)
    page.call("Network.emulateNetworkConditions", offline=True, latency=0,
             downloadThroughput=-1, uploadThroughput=-1)  # fmt: skip
    page.value("source.close(), listen()")
    page.until(lost)
    assert page.value(WORDS) == "TURN TO"  # what was known last stays in sight
    server.board.position_asked(Hold(2, FIVE_POSITIONS[2], 30.0))
    page.call("Network.emulateNetworkConditions", offline=False, latency=0,
             downloadThroughput=-1, uploadThroughput=-1)  # fmt: skip
    page.until(lost, False)
    assert page.text("angles") == FIVE_POSITIONS[2].name


def test_the_end_stays_though_nothing_is_served_any_more(page: Screen) -> None:
    with PageServer("127.0.0.1") as server:
        server.board = Board("fieldcal", FIVE_POSITIONS)
        server.board.position_asked(Hold(0, FIVE_POSITIONS[0], 30.0))
        opened(page, server)
        server.board.run_ended("GO", [], good=True)
    page.until(f"{WORDS} === 'GO'")
    assert page.value("document.getElementById('lost').hidden")
    assert page.value("document.getElementById('mine').hidden")
