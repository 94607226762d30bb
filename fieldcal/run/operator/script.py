"""Run without a person: a mover turns the device, standard error gets JSON lines.

Each line has its event and the host's time; the last one is "end", with the exit code.
"""

from __future__ import annotations

import json
import sys
from typing import IO, Any

import numpy as np

from fieldcal.drivers.driver import host_clock
from fieldcal.planning.steps import Hold
from fieldcal.run.movers import Mover
from fieldcal.run.operator.protocol import OperatorView, Wish
from fieldcal.run.wait_reason import WaitReason, WaitState, reminder

PROGRESS_EVERY_S = 5.0
"""Time between two lines of progress, s of device time."""


class ScriptOperator:
    """Operator that turns the device by a mover and reports as JSON lines.

    Parameters
    ----------
    mover : who turns
    out : where the lines go; standard error if not given

    """

    def __init__(self, mover: Mover, out: IO[str] | None = None) -> None:
        self._mover = mover
        self._out = out or sys.stderr
        self._shown: tuple[str, int, int, WaitState | None] = ("", -1, -1, None)

    def place(self, hold: Hold) -> None:
        """Begin to turn."""
        self._say("place", position=hold.index, name=hold.position.name)
        self._mover.turn(hold.position, hold.index)

    def tell(self, text: str) -> None:
        """Report a sentence."""
        self._say("tell", text=text)

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        """Report the reason for waiting."""
        self.tell(reminder(waited) + reason.text)

    def wish(self) -> Wish | None:
        """Wait for a mover that is still at work."""
        return "wait" if self._mover.busy() else None

    def show(self, view: OperatorView) -> None:
        """Report progress: each change of phase, and now and then within one."""
        step = int(view.elapsed // PROGRESS_EVERY_S)
        now = (view.phase, view.hold.index, step, view.reason.state)
        if now == self._shown:
            return
        self._shown = now
        self._say(
            view.phase,
            position=view.hold.index,
            elapsed_s=round(view.elapsed, 2),
            of_s=view.hold.seconds,
            sigma=[_number(s) for s in view.sigma],
            waiting_for=view.reason.text or None,
        )

    def _say(self, event: str, **what: Any) -> None:
        report_event(event, self._out, **what)


def report_event(event: str, out: IO[str] | None = None, **what: Any) -> None:
    """Write one event as a line, to standard error by default."""
    out = out or sys.stderr
    line = {"event": event, "host_s": round(host_clock(), 3), **what}
    out.write(json.dumps(line) + "\n")
    out.flush()


def _number(value: float) -> float | None:
    return float(f"{value:.3g}") if np.isfinite(value) else None
