"""What the page has to show, and who may press its buttons."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.drivers.driver import LinkHealth
from fieldcal.planning.steps import Hold
from fieldcal.run.operator.protocol import OperatorView, Phase, Wish
from fieldcal.run.page.board import Board
from fieldcal.run.page.buttons import GONE_AFTER_S, Buttons
from fieldcal.run.page.page_operator import PageOperator
from fieldcal.run.position_check import PositionCheck
from fieldcal.run.wait_reason import WaitReason, WaitState

HOLD = Hold(3, FIVE_POSITIONS[3], 30.0)
NEAR = PositionCheck(False, 20.04, -1.26, "", 2.0)


def view(phase: Phase, hold: Hold = HOLD, **changes: object) -> OperatorView:
    known: dict[str, object] = {
        "arrival": NEAR if phase == "turning" else None,
        "stillness": 0.4,
        "elapsed": 12.0,
        "sigma": np.array([1e-3, 2e-3, 3e-3, 1e-5, 1e-5, 2e-5]),
        "reason": WaitReason(WaitState.TURNING),
        "rate_hz": 100.0,
        "temperature": 24.5,
        "health": LinkHealth(samples=1234),
    }
    return OperatorView(phase, hold, **(known | changes))  # type: ignore[arg-type]


def test_a_turn_is_shown_with_where_it_is_and_where_it_should_be() -> None:
    board = Board("fieldcal", FIVE_POSITIONS)
    board.position_asked(HOLD)
    board.view_changed(view("turning"))
    now = board.content()
    assert (now["words"], now["detail"]) == ("TURN TO", "position 4 of 5, then let go")
    assert now["there"] == {"alpha_deg": 20.0, "beta_deg": -1.3, "ok": False}
    assert now["wanted"] == {"alpha_deg": 45.0, "beta_deg": 2.5}
    assert now["reason"] == "waiting for the turn"
    assert "100 Hz" in now["link"] and "elapsed_s" not in now


def test_a_window_fills_and_is_listed_when_it_is_taken() -> None:
    board = Board("fieldcal", FIVE_POSITIONS)
    board.sentence_told("the device was moved")
    board.position_asked(HOLD)
    board.view_changed(view("averaging"))
    now = board.content()
    assert now["words"] == "HOLD STILL" and now["colour"] == "green"
    assert (now["elapsed_s"], now["seconds"]) == (12.0, 30.0)
    assert now["reached"] == "± 3.00 mm/s², 0.020 mrad/s" and now["still"] is True
    assert now["told"] == ["the device was moved"]
    board.view_changed(view("taken"))
    now = board.content()
    assert now["words"] == "TAKEN" and now["told"] == []
    states = ["", "", "", "taken   ± 3.00 mm/s²", ""]
    assert [row["state"] for row in now["positions"]] == states
    board.position_asked(HOLD)  # once more
    states[3] = "now"
    assert [row["state"] for row in board.content()["positions"]] == states


def test_gyroscopes_alone_have_no_error_of_a_force() -> None:
    board = Board("fieldcal", FIVE_POSITIONS)
    board.position_asked(HOLD)
    board.view_changed(view("taken", sigma=np.array([np.nan, np.nan, np.nan, 1, 1, 1])))
    assert board.content()["positions"][3]["state"] == "taken"


def test_what_was_said_of_the_turn_is_done_when_the_window_begins() -> None:
    board = Board("fieldcal", FIVE_POSITIONS)
    board.position_asked(HOLD)
    board.view_changed(view("turning"))
    board.sentence_told("press s once more")
    board.alarm_repeated(60.0)
    board.view_changed(view("averaging"))
    assert board.content()["told"] == []
    wrong = WaitReason(WaitState.MISPLACED, "it is off")
    board.view_changed(view("turning", reason=wrong))  # for the first time since
    assert board.content()["told"] == ["it is off"]


def test_what_needs_the_operator_is_said_with_how_long_it_waits() -> None:
    board = Board("fieldcal", FIVE_POSITIONS)
    board.position_asked(HOLD)
    wrong = WaitReason(WaitState.MISPLACED, "the device is at α = 3.0°")
    board.view_changed(view("turning", reason=wrong))
    board.alarm_repeated(60.0)
    now = board.content()
    assert now["colour"] == "yellow"
    assert now["told"] == ["still waiting, 60 s: the device is at α = 3.0°"]


def test_positions_that_are_found_on_the_way_are_listed() -> None:
    board = Board("fieldcal", FIVE_POSITIONS[:1], most=9)
    board.position_asked(Hold(0, FIVE_POSITIONS[0], 30.0))
    board.position_asked(Hold(1, FIVE_POSITIONS[4], 30.0))
    now = board.content()
    assert now["detail"] == "position 2 of at most 9, then let go"
    assert [row["name"] for row in now["positions"]] == [
        FIVE_POSITIONS[0].name,
        FIVE_POSITIONS[4].name,
    ]


def test_what_others_wrote_is_shown_and_never_carried_out() -> None:
    evil = Position("\x1b]0;GO\x07", 0.0, 0.0)
    board = Board("fieldcal", [evil])
    board.position_asked(Hold(0, evil, 30.0))
    board.sentence_told("a\u202eb")
    now = board.content()
    assert now["positions"][0]["name"] == r"\x1b]0;GO\x07"
    assert now["told"] == [r"a\u202eb"]


def test_the_end_is_what_is_shown_last() -> None:
    board = Board("fieldcal", FIVE_POSITIONS)
    board.position_asked(HOLD)
    board.view_changed(view("averaging"))
    before = board.version
    board.run_ended("NO-GO", ["take position 3 again"], good=False)
    now = board.content()
    assert (now["words"], now["colour"], now["ended"]) == ("NO-GO", "red", True)
    assert now["told"] == ["take position 3 again"] and "phase" not in now
    assert now["now"] is None and not any(row["state"] for row in now["positions"])
    assert board.version > before


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_one_has_the_buttons_and_all_others_watch() -> None:
    clock = Clock()
    buttons = Buttons(clock)
    assert buttons.is_free() and buttons.take("a")
    assert buttons.note_watcher("a") and not buttons.note_watcher("b")
    assert not buttons.take("b") and not buttons.press("b", "stop")
    assert buttons.press("a", "repeat") and buttons.pressed() == "repeat"
    assert buttons.pressed() is None
    assert buttons.take("b", over=True) and not buttons.press("a", "stop")


def test_a_stop_is_heard_whatever_is_pressed_or_asked_for_behind_it() -> None:
    buttons = Buttons(Clock())
    buttons.take("a")
    buttons.press("a", "stop")
    assert buttons.press("a", "confirm")
    buttons.forget()
    assert buttons.pressed() == "stop" and buttons.pressed() is None
    buttons.press("a", "skip")
    buttons.forget()
    assert buttons.pressed() is None


def test_whoever_is_gone_leaves_the_buttons() -> None:
    clock = Clock()
    buttons = Buttons(clock)
    buttons.take("a")
    clock.now = GONE_AFTER_S - 1
    assert buttons.note_watcher("a") and not buttons.is_free()
    clock.now += GONE_AFTER_S - 1
    assert not buttons.is_free() and not buttons.take("b")
    clock.now += 2
    assert buttons.is_free() and buttons.take("b")


class Console:
    """An operator that notes what it is shown."""

    def __init__(self) -> None:
        self.seen: list[object] = []
        self.wishes: list[Wish | None] = []

    def place(self, hold: Hold) -> None:
        self.seen.append(hold)

    def tell(self, text: str) -> None:
        self.seen.append(text)

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        self.seen.append((reason, waited))

    def show(self, view: OperatorView) -> None:
        self.seen.append(view)

    def wish(self) -> Wish | None:
        return self.wishes.pop() if self.wishes else None


def test_the_console_is_shown_everything_and_both_may_wish() -> None:
    console, board, buttons = Console(), Board("fieldcal", FIVE_POSITIONS), Buttons()
    both = PageOperator(console, board, buttons)
    buttons.take("a")
    buttons.press("a", "skip")
    now, reason = view("turning"), WaitReason(WaitState.NO_SAMPLES, "no samples")
    both.place(HOLD)  # what was pressed before was meant for what is over
    assert both.wish() is None
    both.tell("said")
    both.alarm(reason, 30.0)
    both.show(now)
    assert console.seen == [HOLD, "said", (reason, 30.0), now]
    assert board.content()["words"] == "TURN TO"
    buttons.press("a", "confirm")
    assert both.wish() == "confirm"


def test_no_button_breaks_off_a_turn() -> None:
    console, board, buttons = Console(), Board("fieldcal", FIVE_POSITIONS), Buttons()
    both = PageOperator(console, board, buttons)
    buttons.take("a")
    console.wishes = [None, "wait", "wait"]
    buttons.press("a", "repeat")
    assert [both.wish() for _ in range(3)] == ["wait", "wait", "repeat"]
    assert console.seen == ["r counts once the mover is done; q ends at once"]
    console.wishes = ["wait", "stop", "wait"]
    buttons.press("a", "confirm")
    assert [both.wish() for _ in range(2)] == ["wait", "stop"]
    buttons.press("a", "stop")
    assert both.wish() == "stop"


@pytest.mark.parametrize("name", ["page.html", "page.css", "page.js"])
def test_nothing_of_the_page_comes_from_elsewhere(name: str) -> None:
    text = (Path("fieldcal/run/page/files") / name).read_text(encoding="utf-8")
    assert (
        "http:" not in text
        and "https:" not in text
        and "//" not in text.replace("// ", "")
    )
