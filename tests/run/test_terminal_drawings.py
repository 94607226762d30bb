"""The drawing of the device, the scale and the clock on the operator's console."""

from __future__ import annotations

import io

import numpy as np
import pytest
from rich.console import Console
from terminal_screens import HOLD, SCREENS, Keys, screen, view

from fieldcal.core.positions import FIVE_POSITIONS, Position
from fieldcal.drivers.driver import ClockFit, LinkHealth
from fieldcal.planning.steps import Hold
from fieldcal.run.movers import ManualMover
from fieldcal.run.operator.box import EMPTY_BRAILLE, draw_box, draw_joints
from fieldcal.run.operator.terminal import ConsoleOperator
from fieldcal.run.operator.widgets import HALF_WIDTH, RULER, inclinometer, link_state
from fieldcal.run.wait_reason import WaitReason, WaitState


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
