"""An engine on the virtual device, and an operator who turns it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fieldcal.core.positions import Position
from fieldcal.planning.holding import hold_each
from fieldcal.planning.steps import Hold, Plan
from fieldcal.run.engine import Engine
from fieldcal.run.operator.protocol import OperatorView, Wish
from fieldcal.run.wait_reason import WaitReason, reminder
from fieldcal.session import description_file
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device.in_process import InProcess
from fieldcal.windows import Average

ABOUT = description_file.parse_description(
    {"site": {"latitude_deg": 50.45, "height_m": 170.0}}
)


@dataclass
class Turner:
    """Turns the virtual device, and slips on the way as it is told to."""

    driver: InProcess
    slips: list[tuple[float, float]] = field(default_factory=list)
    bump_at: list[float] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    views: list[OperatorView] = field(default_factory=list)
    late: Position | None = None
    corrects: bool = True
    bumped: list[float] = field(default_factory=list)
    wishes: list[Wish | None] = field(default_factory=list)

    def place(self, hold: Hold) -> None:
        alpha, beta = hold.position.degrees or (0.0, 0.0)
        if self.slips:
            alpha, beta = self.slips.pop(0)
            self.late = hold.position
        self.driver.place(Position.deg(alpha, beta))

    def tell(self, text: str) -> None:
        self.told.append(text)
        if self.late and self.corrects:
            self.driver.place(self.late)
            self.late = None

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        self.tell(reminder(waited) + reason.text)

    def wish(self) -> Wish | None:
        return self.wishes.pop(0) if self.wishes else None

    def show(self, view: OperatorView) -> None:
        self.views.append(view)
        if self.bump_at and view.elapsed > self.bump_at[0]:
            self.bump_at.pop(0)
            self.bumped.append(self.driver.device.time)
            self.driver.device.bump()


@dataclass
class Bench:
    """An engine with everything around it."""

    folder: Path
    turner: Turner
    engine: Engine
    recorder: Recorder


def hold_all(
    positions: Sequence[Position], seconds: float
) -> Plan[tuple[Average, ...]]:
    """Hold every position; the averages in order."""
    held = yield from hold_each(positions, seconds)
    return tuple(held.values())


def make(recorder: Recorder, driver: InProcess, lost_share: float = np.inf) -> Bench:
    turner = Turner(driver)
    engine = Engine(
        driver, turner, ABOUT, recorder, give_up=60.0, lost_share=lost_share
    )
    return Bench(recorder.folder, turner, engine, recorder)


def events(bench: Bench) -> list[str]:
    bench.recorder.close()
    return [m["event"] for m in Session.open(bench.folder).marks()]
