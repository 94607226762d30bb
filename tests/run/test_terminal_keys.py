"""What keys do: leaving out, stopping, and keys that arrive in parts."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator

import pytest
from terminal_screens import Keys, screen, sized, view

from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.planning.steps import Hold
from fieldcal.run.movers import ManualMover
from fieldcal.run.operator import terminal
from fieldcal.run.operator.keyboard import Keyboard
from fieldcal.run.operator.protocol import Phase


def test_leaving_out_is_asked_back() -> None:
    operator = sized(80, 24, "skip", "skip")
    assert operator.wish() is None
    assert "press s once more to leave α = 22.5°, β = 0° out" in screen(operator)
    assert operator.wish() == "skip"
    assert "press s" not in screen(operator)


def test_each_position_is_left_out_by_two_presses_of_its_own() -> None:
    operator = sized(80, 24, "skip", "skip", "skip", "skip")
    assert [operator.wish() for _ in range(4)] == [None, "skip", None, "skip"]


def test_a_press_for_a_position_that_was_taken_leaves_out_no_other_one() -> None:
    operator = sized(80, 24, "skip", "skip", "skip")
    assert operator.wish() is None
    operator.show(view("taken"))
    operator.place(Hold(2, FIVE_POSITIONS[2], 30.0))
    assert operator.wish() is None
    assert f"press s once more to leave {FIVE_POSITIONS[2].name}" in screen(operator)
    operator.place(Hold(2, FIVE_POSITIONS[2], 30.0))  # again, after a disturbance
    assert operator.wish() == "skip"


def test_what_a_second_press_no_longer_does_is_not_shown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [1000.0]
    monkeypatch.setattr(terminal, "monotonic", lambda: now[0])
    operator = sized(80, 24, "skip")
    assert operator.wish() is None
    now[0] += 0.9 * terminal.CONFIRM_WITHIN_S
    assert operator.wish() is None
    assert "press s once more" in screen(operator)
    now[0] += 0.2 * terminal.CONFIRM_WITHIN_S
    assert operator.wish() is None
    assert "press s" not in screen(operator)
    operator._keyboard = Keys("skip")
    assert operator.wish() is None
    assert "press s once more" in screen(operator)


class Table(ManualMover):
    """A turntable that is on its way until it is told otherwise."""

    turning = True

    def busy(self) -> bool:
        return self.turning


def test_no_key_breaks_off_a_turn() -> None:
    """A program that is killed half way leaves its table anywhere."""
    operator = sized(80, 24, "repeat", "confirm")
    table = operator._mover = Table()
    assert [operator.wish() for _ in range(3)] == ["wait"] * 3
    shown = " ".join(screen(operator).split())
    assert "r counts once the mover is done" in shown and "not yet: the mo" in shown
    table.turning = False
    assert [operator.wish() for _ in range(2)] == ["repeat", None]
    table.turning, operator._keyboard = True, Keys("skip", "skip", "stop", "stop")
    assert [operator.wish() for _ in range(3)] == ["wait", "wait", "stop"]
    operator.place(Hold(2, FIVE_POSITIONS[2], 30.0))
    table.turning = False
    assert [operator.wish() for _ in range(2)] == ["stop", None]


def test_no_key_halts_a_run_and_a_wish_to_stop_is_heard(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    termios = pytest.importorskip("termios")
    hand, terminal_file = os.openpty()
    before = termios.tcgetattr(terminal_file)
    with os.fdopen(terminal_file) as file:
        monkeypatch.setattr(sys, "stdin", file)
        with Keyboard() as keyboard:
            os.write(hand, b"\x1a\x13\x1cr")  # Ctrl-Z, Ctrl-S, Ctrl-\: do nothing
            assert keyboard.pressed() == "repeat"
            os.write(hand, b"q\n")
            assert keyboard.pressed() == "stop"
            os.write(hand, b"\x1bOP\x1bOQ\x1bOR\x1bOS\x1b[15~\x1b[1;2S\x1b[A\x1bq\x1b")
            assert keyboard.pressed() is None  # F1 to F5, Shift-F4, an arrow, Alt-q
            os.write(hand, b"\x1b[Br\x1bOQ")
            assert keyboard.pressed() == "repeat"
            os.write(hand, b"rs")
            assert keyboard.pressed() == "skip" and keyboard.pressed() is None
            os.write(hand, b"rs")
            keyboard.forget()
            assert keyboard.pressed() is None
            os.write(hand, b"q")
            keyboard.forget()  # a position is asked for: who wants to stop still does
            assert keyboard.pressed() == "stop" and keyboard.pressed() is None
        assert termios.tcgetattr(terminal_file) == before
    os.close(hand)


def test_pasted_text_presses_no_key(hand: int) -> None:
    """A command line in the clipboard has a q, and would skip by its double s."""
    with Keyboard() as keyboard:
        os.write(hand, b"\x1b[200~run --resume sessions/q\rss\x1b[201~r")
        assert keyboard.pressed() == "repeat" and keyboard.pressed() is None
        for piece in (b"\x1b[20", b"0~", b"qq\nss", b"\x1b[2", b"01~"):
            os.write(hand, piece)
            assert keyboard.pressed() is None
        os.write(hand, b"q")
        assert keyboard.pressed() == "stop"


@pytest.fixture
def hand(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The end of a terminal at which somebody sits; standard input is its other end."""
    pytest.importorskip("termios")
    sitting, terminal_file = os.openpty()
    with os.fdopen(terminal_file) as file:
        monkeypatch.setattr(sys, "stdin", file)
        yield sitting


@pytest.mark.parametrize("key", ["\x1bOQ", "\x1bOS", "\x1b[15~", "\x1b[1;2S", "\x1b[A"])
def test_a_key_that_arrives_in_parts_is_no_letter(hand: int, key: str) -> None:
    """Over a slow link F2 is ESC O, and some time later Q."""
    with Keyboard() as keyboard:
        for at in range(1, len(key)):
            os.write(hand, key[:at].encode())
            assert keyboard.pressed() is None and keyboard.pressed() is None
            os.write(hand, key[at:].encode())
            assert keyboard.pressed() is None
        os.write(hand, b"\x1b")
        assert keyboard.pressed() is None
        os.write(hand, b"q")  # Escape, and later a letter
        assert keyboard.pressed() == "stop"
    os.close(hand)


def test_two_presses_of_s_leave_out_however_soon_they_follow(hand: int) -> None:
    with Keyboard() as keyboard:
        os.write(hand, b"ss")
        assert [keyboard.pressed() for _ in range(3)] == ["skip", "skip", None]
        os.write(hand, b"ssr")
        assert keyboard.pressed() == "repeat" and keyboard.pressed() is None
        os.write(hand, b"ss")
        assert keyboard.pressed() == "skip"
        keyboard.forget()  # the second one was not for the next position
        assert keyboard.pressed() is None
    os.close(hand)


def test_a_terminal_that_is_gone_has_no_keys_and_ends_nothing(hand: int) -> None:
    with Keyboard() as keyboard:
        assert keyboard.has_keys
        os.close(hand)
        assert keyboard.pressed() is None
        assert not keyboard.has_keys


@pytest.mark.parametrize(
    ("phase", "named", "not_named"),
    [("averaging", "r begin again", "Enter"), ("taken", "Ctrl-C", "Enter"),
     ("silent", "q stop", "skip"), ("turning", "Enter confirm", "Ctrl-C")],
)  # fmt: skip
def test_only_keys_that_do_something_are_named(
    phase: Phase, named: str, not_named: str
) -> None:
    for width, height in ((80, 24), (40, 15)):
        operator = sized(width, height)
        operator.show(view(phase))
        last = screen(operator, width, height).strip().splitlines()[-2:]
        foot = " ".join(last)
        assert named.split()[0] in foot and not_named not in foot
