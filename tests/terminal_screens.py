"""Screens of the operator's console, and keys that are pressed."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from rich.console import Console

from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.drivers.driver import LinkHealth
from fieldcal.planning.steps import Hold
from fieldcal.run.movers import ManualMover
from fieldcal.run.operator.keyboard import Keyboard
from fieldcal.run.operator.protocol import OperatorView, Phase, Wish
from fieldcal.run.operator.terminal import ConsoleOperator
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


SCREENS = Path(__file__).parent / "run" / "screens"


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
