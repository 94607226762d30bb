"""What the operator reads, rendered as on a terminal of 80 by 24 and on a plain one."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.drivers.driver import ClockFit, LinkHealth
from fieldcal.planning.steps import Hold
from fieldcal.run.movers import ManualMover
from fieldcal.run.operator import terminal
from fieldcal.run.operator.banner import can_draw, draw_large
from fieldcal.run.operator.box import EMPTY_BRAILLE, draw_box, draw_joints
from fieldcal.run.operator.keyboard import Keyboard
from fieldcal.run.operator.protocol import OperatorView, Phase, Wish
from fieldcal.run.operator.terminal import ConsoleOperator
from fieldcal.run.operator.widgets import HALF_WIDTH, RULER, inclinometer, link_state
from fieldcal.run.position_check import PositionCheck
from fieldcal.run.wait_reason import WaitReason, WaitState

MISPLACED = WaitReason(WaitState.MISPLACED, "the device is at α = 3.0°")
HOLD = Hold(1, FIVE_POSITIONS[1], 30.0)


def view(phase: Phase, elapsed: float = 0.0, **changes: object) -> OperatorView:
    known: dict[str, object] = {
        "phase": phase,
        "hold": HOLD,
        "arrival": PositionCheck(False, 3.0, 0.2, "the device is at α = 3.0°"),
        "stillness": 0.4,
        "elapsed": elapsed,
        "sigma": np.array([1e-3, 2e-3, 3e-3, 1e-5, 1e-5, 2e-5]),
        "reason": MISPLACED,
        "rate_hz": 100.0,
        "temperature": 24.5,
        "health": LinkHealth(samples=1234),
    }
    return OperatorView(**(known | changes))  # type: ignore[arg-type]


SCREENS = Path(__file__).parent / "screens"


class Keys(Keyboard):
    """A keyboard at which nobody sits but a test."""

    def __init__(self, *wishes: Wish) -> None:
        self.wishes = list(wishes)

    has_keys = True

    def pressed(self) -> Wish | None:
        return self.wishes.pop(0) if self.wishes else None

    def forget(self) -> None: ...


def sized(width: int, height: int, *wishes: Wish) -> ConsoleOperator:
    """A console of that size, at the second position of five."""
    file = io.StringIO()
    console = Console(file=file, width=width, height=height, force_terminal=True)
    made = ConsoleOperator(
        "fieldcal · five_position",
        FIVE_POSITIONS,
        ManualMover(),
        console,
        keyboard=Keys(*wishes),
    )
    made.place(HOLD)
    return made


def screen(operator: ConsoleOperator, width: int = 80, height: int = 24) -> str:
    out = io.StringIO()
    Console(file=out, width=width, height=height, color_system=None).print(
        operator.screen()
    )
    return out.getvalue()


@pytest.fixture
def operator() -> ConsoleOperator:
    console = Console(file=io.StringIO(), width=80, height=24, force_terminal=True)
    made = ConsoleOperator(
        "fieldcal · five_position", FIVE_POSITIONS, ManualMover(), console
    )
    made.place(HOLD)
    return made


def test_turning_says_where_to_where_it_is_and_what_it_waits_for(
    operator: ConsoleOperator,
) -> None:
    operator.show(view("turning"))
    said = screen(operator)
    assert "T U R N   T O   α = 22.5°, β = 0°" in said
    assert "+3.0°" in said and "turn +19.5°" in said
    assert "100 Hz" in said and "24.5 °C" in said


@pytest.mark.parametrize(("width", "height"), [(80, 24), (40, 15)])
def test_positions_that_are_found_on_the_way_are_counted_as_they_come(
    width: int, height: int
) -> None:
    console = Console(file=io.StringIO(), width=width, height=height)
    made = ConsoleOperator(
        "adaptive", FIVE_POSITIONS[:2], ManualMover(), console, most=9
    )
    made.place(HOLD)
    made.place(Hold(2, FIVE_POSITIONS[4], 30.0))
    said = screen(made, width, height)
    assert "α = 45°, β = 5°" in said and "/2" not in said
    assert "position 3 of at most 9" in said or width < 80
    made.place(HOLD)  # once more
    assert "α = 45°, β = 5°" in screen(made) or width < 80


def test_averaging_says_hold_still_time_left_and_what_is_reached(
    operator: ConsoleOperator,
) -> None:
    operator.show(view("averaging", 12.0))
    said = screen(operator)
    assert "H O L D   S T I L L" in said and "18 s" in said and "3.00 mm/s²" in said


def test_a_position_taken_is_ticked_off_with_its_sigma(
    operator: ConsoleOperator,
) -> None:
    operator.show(view("taken", 30.0))
    assert "taken   ± 3.00 mm/s²" in screen(operator)


@pytest.mark.parametrize("size", [(80, 24), (60, 20), (40, 15)])
def test_while_the_next_position_is_chosen_it_says_so(size: tuple[int, int]) -> None:
    operator = sized(*size)
    operator.show(view("taken", 30.0, hold=operator._shown.hold))
    assert "what comes next is being worked out" in screen(operator)


def test_what_went_wrong_stays_until_the_position_is_taken(
    operator: ConsoleOperator,
) -> None:
    operator.tell("disturbed at 12.3 s on ay")
    operator.place(HOLD)
    operator.show(view("averaging", 1.0))
    assert "! disturbed at 12.3 s on ay" in screen(operator)
    operator.show(view("taken", 30.0))
    assert "disturbed" not in screen(operator)


def test_what_was_wrong_with_the_turn_is_gone_once_it_is_done(
    operator: ConsoleOperator,
) -> None:
    operator.show(view("turning"))
    operator.alarm(MISPLACED, 60.0)
    assert screen(operator).count("the device is at α = 3.0°") == 1
    assert "still waiting, 60 s: the device is at" in screen(operator)
    operator.tell("not yet: it moves")
    assert "! not yet" in screen(operator)
    operator.show(view("averaging", 1.0, reason=WaitReason()))
    assert "!" not in screen(operator)


def test_a_link_that_is_silent_is_said_large_and_for_as_long_as_it_is(
    operator: ConsoleOperator,
) -> None:
    silent = WaitReason(WaitState.NO_SAMPLES, "no samples come from ttyUSB0: check it")
    operator.show(view("silent", reason=silent))
    said = screen(operator)
    assert "N O   S A M P L E S" in said and "! no samples come from ttyUSB0" in said
    operator.show(view("turning"))
    assert "S A M P L E S" not in screen(operator)


def test_hands_off_does_not_ask_to_be_turned_on(operator: ConsoleOperator) -> None:
    there = PositionCheck(True, 21.0, 1.2, limit_deg=2.4)
    operator.show(view("turning", arrival=there, reason=WaitReason(WaitState.SETTLING)))
    said = screen(operator)
    assert "H A N D S   O F F" in said and said.count("close enough") == 2
    assert "+21.0° to +22.5° ± 2.4°" in said
    warms = "the device is still warming up: +4.0 ± 0.2 K/min"
    reason = WaitReason(WaitState.WARMING_UP, warms)
    operator.show(view("turning", arrival=there, reason=reason))
    assert "W A I T" in screen(operator) and f"{warms}; Enter" in screen(operator)


@pytest.mark.parametrize("phase", ["turning", "averaging", "taken"])
def test_everything_fits_80_by_24(operator: ConsoleOperator, phase: Phase) -> None:
    operator.tell("a sentence of the usual length about what happened, and what to do")
    operator.tell("α is turned the wrong way: it is at α = -22.3°, β = 0.1° instead")
    operator.show(view(phase, 10.0))
    operator.tell("α is turned the wrong way: it is at α = -22.3°, β = 0.1° instead")
    lines = screen(operator).splitlines()
    assert len(lines) <= 24 and max(map(len, lines)) <= 80


def test_on_a_tall_screen_the_instruction_is_read_from_afar() -> None:
    out = io.StringIO()
    console = Console(file=out, width=100, height=40, force_terminal=True)
    made = ConsoleOperator("t", FIVE_POSITIONS, ManualMover(), console)
    made.place(HOLD)
    made.show(view("turning"))
    console.print(made.screen())
    lines = out.getvalue()
    for line in [*draw_large("TURN TO"), *draw_large("α 22.5°  β 0°")]:
        assert line in lines
    assert len(lines.splitlines()) <= 40
    assert not can_draw("WAIT FOR ME?") and can_draw("HOLD STILL")


def test_many_positions_leave_room_for_what_is_said() -> None:
    console = Console(file=io.StringIO(), width=80, height=24, force_terminal=True)
    with ConsoleOperator("t", FIVE_POSITIONS * 6, ManualMover(), console) as made:
        made.place(Hold(14, FIVE_POSITIONS[4], 30.0))
        made.tell("a sentence of the usual length about what happened, and what to do")
        made.show(view("turning", hold=Hold(14, FIVE_POSITIONS[4], 30.0)))
        said = screen(made)
    assert len(said.splitlines()) <= 24 and "15  α = 45°, β = 5°" in said
    assert "link: 100 Hz" in said and "! a sentence of the usual" in said


def test_plain_lines_for_a_log() -> None:
    out = io.StringIO()
    console = Console(file=out, width=200)
    with ConsoleOperator(
        "t", FIVE_POSITIONS, ManualMover(), console, plain=True
    ) as operator:
        operator.place(HOLD)
        operator.tell("bumped")
        for elapsed in np.arange(0, 30, 0.1):
            operator.show(view("averaging", float(elapsed)))
        operator.show(view("taken", 30.0))
    lines = out.getvalue().splitlines()
    assert lines[0].startswith("position 2: turn to α = 22.5°")
    assert lines[1] == "! bumped" and lines[-1].startswith("position 2: taken, ± 3.00")
    assert len(lines) == 6


@pytest.mark.parametrize("size", [(80, 24), (60, 20), (40, 15), (110, 40)])
@pytest.mark.parametrize("phase", ["turning", "averaging"])
def test_the_screen_is_as_kept(size: tuple[int, int], phase: Phase) -> None:
    operator = sized(*size)
    said = WaitReason() if phase == "averaging" else MISPLACED
    operator.show(view(phase, 12.0, reason=said))
    shown = [line.rstrip() for line in screen(operator, *size).splitlines()]
    kept = SCREENS / f"{phase}-{size[0]}x{size[1]}.txt"
    assert "\n".join(shown).rstrip() + "\n" == kept.read_text(encoding="utf-8")


@pytest.mark.parametrize("size", [(80, 24), (76, 22), (60, 20), (40, 15)])
@pytest.mark.parametrize("phase", ["turning", "averaging", "silent"])
def test_on_any_screen_instruction_reason_and_keys_are_seen(
    size: tuple[int, int], phase: Phase
) -> None:
    """However much is said: what to do stands first, the keys stand last."""
    operator = sized(*size)
    long = WaitReason(
        WaitState.MISPLACED,
        "α is turned the wrong way: the device is at α = -22.3°, β = 0.1°, asked for"
        " is α = 22.5°, β = 0°",
    )
    operator.tell("disturbed 12.3 s into the window on ay: a 0.1 s push of +0.13 m/s²")
    operator.show(view(phase, 10.0, reason=long))
    lines = screen(operator, *size).splitlines()
    text = " ".join(line.strip("│ ").rstrip() for line in lines)
    assert len(lines) <= size[1] and max(map(len, lines)) <= size[0]
    words = {"turning": "TURN TO", "averaging": "HOLD STILL", "silent": "NO SAMPLES"}
    assert words[phase].replace(" ", "") in lines[0 if size[0] < 76 else 1].replace(
        " ", ""
    )
    assert "α is turned the wrong way: the device" in " ".join(text.split())
    keys = [i for i, line in enumerate(lines) if "q stop" in line]
    assert keys and keys[-1] >= len(lines) - 2


def test_on_a_small_screen_the_present_reason_outlives_what_was_said() -> None:
    operator = sized(40, 15)
    operator.tell("no samples came between 536.28 s and 545.73 s: check the cable" * 2)
    operator.tell("disturbed 12.3 s into the window on ay: a 0.1 s push of 0.13 m/s²")
    wrong = WaitReason(
        WaitState.MISPLACED,
        "both angles are turned the wrong way: the device is at α = -22.3°, β = -5.1°,"
        " asked for is α = 22.5°, β = 5°; press Enter once more to take it like this,"
        " and the result is NO-GO",
    )
    operator.show(view("turning", reason=wrong))
    lines = screen(operator, 40, 15).splitlines()
    text = " ".join(" ".join(lines).split())
    assert "the result is NO-GO" in text and "now 2" in text and "q stop" in lines[-1]
    assert "536.28" not in text


def test_the_scale_is_always_the_same() -> None:
    """35 degrees off is drawn farther than 22, and a tick is where its label says."""
    places = []
    for off in (0.0, 2.0, 5.0, 15.0, 22.0, 35.0, 45.0, 90.0, 180.0):
        drawn = inclinometer(0.0, off, 1.0, ok=False).plain
        places.append(drawn.index("|") - drawn.index("o") if off else 0)
    assert places == sorted(places) and len(set(places[3:7])) >= 2
    assert places[-1] == HALF_WIDTH
    bar = inclinometer(-45.0, 0.0, 1.0, ok=False).plain
    assert RULER[bar.index("o") - 1 : bar.index("o") + 2] == "-45"
    assert RULER.index("0") == bar.index("|")


@pytest.mark.parametrize(("sigma", "shown"), [(0.3, "1"), (9.6, "10"), (43.0, "43")])
def test_the_clock_is_shown_in_whole_ppm(sigma: float, shown: str) -> None:
    health = LinkHealth(samples=1234, clock=ClockFit(-20.2, sigma, 0.0, 1e-3))
    text = link_state(view("averaging", health=health)).plain
    assert text.endswith(f"clock -20 ± {shown} ppm")


def test_a_clock_of_which_nothing_is_known_is_not_shown() -> None:
    """After the computer was asleep."""
    health = LinkHealth(samples=1234, clock=ClockFit(-93958.0, 20272.0, 0.0, 5.0))
    assert "clock" not in link_state(view("averaging", health=health)).plain


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


@pytest.mark.parametrize(
    ("angle", "right_lower", "left_lower"), [(45.0, True, False), (-45.0, False, True)]
)
def test_the_box_is_drawn_turned_clockwise(
    angle: float, right_lower: bool, left_lower: bool
) -> None:
    lowest = draw_box(angle)[-1]
    dots = [i for i, letter in enumerate(lowest) if letter != chr(EMPTY_BRAILLE)]
    middle = (len(lowest) - 1) / 2
    assert (np.mean(dots) > middle) == right_lower
    assert (np.mean(dots) < middle) == left_lower
    assert "facing N" in draw_joints(FIVE_POSITIONS[1], 40, 5)[-1]


@pytest.mark.parametrize("size", [(80, 24), (40, 15), (110, 40)])
def test_a_position_of_three_angles_is_shown_whole(size: tuple[int, int]) -> None:
    file = io.StringIO()
    console = Console(file=file, width=size[0], height=size[1], force_terminal=True)
    third = Position.deg(22.5, 2.5, gamma=120.0)
    every = (*FIVE_POSITIONS[:1], third, *FIVE_POSITIONS[2:])
    made = ConsoleOperator(
        "fieldcal · positions", every, ManualMover(), console, keyboard=Keys()
    )
    made.place(hold := Hold(1, third, 30.0))
    made.show(view("turning", hold=hold, reason=WaitReason(WaitState.TURNING)))
    shown = [line.rstrip() for line in screen(made, *size).splitlines()]
    kept = SCREENS / f"turning-gamma-{size[0]}x{size[1]}.txt"
    assert "\n".join(shown).rstrip() + "\n" == kept.read_text(encoding="utf-8")


def test_pictures_of_three_joints_stand_side_by_side_or_below_or_not_at_all() -> None:
    third = Position.deg(10.0, 5.0, gamma=90.0)
    wide, narrow = draw_joints(third, 40, 5), draw_joints(third, 30, 10)
    for lines in (wide, narrow):
        text = "\n".join(lines)
        assert all(w in text for w in ("α, facing N", "β, facing E", "γ, from above"))
    assert (len(wide), len(narrow)) == (5, 10)
    assert draw_joints(third, 30, 9) == draw_joints(Position("by hand"), 99, 99) == []
    # the arrow of gamma points east
    arrow = draw_box(90.0)
    assert [line[24:].strip() for line in wide[:4]] == [x.strip() for x in arrow]


@pytest.mark.parametrize("size", [(80, 24), (110, 40), (60, 20), (40, 15)])
@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_a_terminal_of_few_letters_gets_others_in_their_place_and_no_drawing(
    size: tuple[int, int], encoding: str
) -> None:
    out = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    console = Console(
        file=out, width=size[0], height=size[1], force_terminal=True, color_system=None
    )
    made = ConsoleOperator("t", FIVE_POSITIONS, ManualMover(), console)
    made.place(HOLD)
    made.show(view("turning"))
    console.print(made.screen())  # strictly: a letter that is not there is an error
    out.flush()
    lines = out.buffer.getvalue().decode(encoding).replace("\a", "").splitlines()
    drawn = lines[-size[1] :]
    assert max(map(len, lines)) <= size[0] and "facing N" not in "".join(lines)
    assert "a = 22.5" in "".join(drawn)
    if size[0] >= 80:
        assert all(len(line) == size[0] and line[-1] in "|+" for line in drawn[1:-1])


def test_no_key_halts_a_run_and_a_wish_to_stop_is_heard(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    termios = pytest.importorskip("termios")
    hand, terminal_file = os.openpty()
    before = termios.tcgetattr(terminal_file)
    with os.fdopen(terminal_file) as file:
        monkeypatch.setattr(sys, "stdin", file)
        with Keyboard() as keyboard:
            os.write(hand, b"\x1a\x13r")  # Ctrl-Z, Ctrl-S: passed on, not carried out
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
