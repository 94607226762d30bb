"""What the operator's console says in each phase, on any size of screen."""

from __future__ import annotations

import io
from threading import Event

import numpy as np
import pytest
from processes import HANGS
from rich.console import Console
from terminal_screens import HOLD, MISPLACED, SCREENS, screen, sized, view

from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.planning.steps import Hold
from fieldcal.run.movers import ManualMover
from fieldcal.run.operator import terminal
from fieldcal.run.operator.banner import can_draw, draw_large
from fieldcal.run.operator.protocol import TAKEN_BEFORE, Phase
from fieldcal.run.operator.redrawing import Redrawing
from fieldcal.run.operator.terminal import ConsoleOperator
from fieldcal.run.position_check import PositionCheck
from fieldcal.run.wait_reason import WaitReason, WaitState


@pytest.fixture
def operator() -> ConsoleOperator:
    """A console of 80 by 24 that asks for a position."""
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


@pytest.mark.parametrize("size", [(80, 24), (60, 20), (40, 15)])
def test_it_says_for_how_long_the_next_position_is_being_worked_out(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    operator, now = sized(*size), [100.0]
    operator._keyboard = None
    monkeypatch.setattr(terminal, "monotonic", lambda: now[0])
    with operator:
        operator.show(view("taken", 30.0, hold=operator._shown.hold))
        assert operator._redrawing.goes_on
        operator._redrawing.stop()  # what it draws is looked at here
        now[0] += 12.0
        operator._draw_work()
        said = " ".join(screen(operator, *size).split())
        assert "being worked out, 12 s" in said
        assert len(screen(operator, *size).splitlines()) <= size[1]
        operator.tell("GO so far")
        assert operator._redrawing.goes_on
        operator.place(Hold(2, FIVE_POSITIONS[2], 30.0))
        assert not operator._redrawing.goes_on
        assert "worked out" not in screen(operator, *size)
    assert not operator._redrawing.goes_on


def test_a_log_of_lines_is_not_drawn_again() -> None:
    out = io.StringIO()
    operator = ConsoleOperator("s", FIVE_POSITIONS, ManualMover(), Console(file=out))
    with operator:
        operator.place(HOLD)
        operator.show(view("taken", 30.0))
        assert not operator._redrawing.goes_on


def test_it_is_drawn_until_it_is_stopped() -> None:
    drawn: list[int] = []
    enough, waits = Event(), []

    def wait(stopped: Event, seconds: float) -> bool:
        waits.append(seconds)
        if len(waits) <= 3:
            return False
        enough.set()
        return stopped.wait()

    redrawing = Redrawing(lambda: drawn.append(len(drawn)), wait)
    redrawing.start()
    assert enough.wait(HANGS)
    redrawing.stop()
    redrawing.stop()
    assert drawn == [0, 1, 2] and set(waits) == {1.0}


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


@pytest.mark.parametrize("size", [(80, 24), (40, 15)])
def test_positions_that_a_remedy_adds_are_counted_from_the_first(
    size: tuple[int, int],
) -> None:
    """Of three more, the first is not the last."""
    operator = sized(*size)
    operator.place(Hold(5, Position.deg(-45.0, 5.0), 9.0, further=2))
    shown = screen(operator, *size)
    assert ("position 6 of 8" if size == (80, 24) else "6/8") in shown
    assert size == (80, 24) or "to come 1 2 3 4 5 7 8" in " ".join(shown.split())


def test_a_lost_device_is_said_once_and_what_was_told_survives_what_is_done() -> None:
    operator = sized(80, 24)
    silent = WaitReason(WaitState.NO_SAMPLES, "no samples come from ttyUSB0: check it")
    operator.show(view("silent", reason=silent))
    operator.tell("ttyUSB0 went silent: goes on by itself, within 117 s")
    shown = screen(operator)
    assert "N O   S A M P L E S" in shown and "within 117 s" in shown
    assert "no samples come from" not in shown  # twice the same, in other words
    operator.tell("samples come from ttyUSB0 again")
    before = Hold(0, FIVE_POSITIONS[0], 30.0)
    operator.show(view("taken", hold=before, reason=TAKEN_BEFORE))
    operator.place(HOLD)
    shown = screen(operator)
    assert "samples come from ttyUSB0 again" in shown and "117 s" not in shown


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
    assert "check the cableno samples ..." in text  # of the oldest what has room


def test_of_what_does_not_fit_the_beginning_is_seen() -> None:
    """A NO-GO and what it asks for, which is why there is one position more."""
    operator = sized(40, 15)
    operator.tell(
        "NO-GO so far: acc_bias y is known to ± 0.026 m/s², more than 0.02 m/s²; "
        + "2 positions more for 31 s, α = -45°, β = -5° and α = 45°, β = -5°: " * 5
    )
    operator.show(view("turning"))
    lines = [line.rstrip() for line in screen(operator, 40, 15).splitlines()]
    said = " ".join(lines)
    assert "! NO-GO so far: acc_bias y is known" in said and "2 positions more" in said
    end = lines.index("! the device is at α = 3.0°")
    assert lines[end - 1].endswith(" ...") and lines[end + 1].startswith("now 2")
    assert "q stop" in lines[-1] and len(lines) == 15
