"""Content of the displays of a run, the same on console and page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.positions import Position
from fieldcal.planning.steps import Hold
from fieldcal.run.operator.instruction import Instruction, position_label
from fieldcal.run.operator.protocol import OperatorView
from fieldcal.run.operator.widgets import alert
from fieldcal.run.wait_reason import WaitState, reminder

SENTENCES_SHOWN = 2
"""Number of sentences that are shown."""


class RunContent:
    """Content of all displays of a run, updated by its events.

    Parameters
    ----------
    title : name of the run, and the folder it is recorded in
    positions : positions that will be asked for
    most : largest number of positions; None if `positions` has them all

    Attributes
    ----------
    taken : standard error of each position taken, m/s^2, by number; nan where the
        device has no accelerometers
    view : present state of the engine
    hold : the position asked for
    worked : for how long what comes next is being worked out, s

    """

    def __init__(
        self, title: str, positions: Sequence[Position], most: int | None = None
    ) -> None:
        self.title, self.positions, self.most = title, list(positions), most
        self.taken: dict[int, float] = {}
        self.view: OperatorView | None = None
        self.hold: Hold | None = None
        self.worked = 0.0
        self._told: list[str] = []
        self._told_before: list[str] = []
        self._reminder = ""
        self._silence_told = False

    def position_asked(self, hold: Hold) -> None:
        """A position is asked for."""
        self.hold = hold
        if hold.index >= len(self.positions):  # found on the way
            self.positions.append(hold.position)
        self._told = self._told_before = self._told[-1:]
        self._reminder = ""
        self.taken.pop(hold.index, None)

    def sentence_told(self, text: str) -> None:
        """A sentence was told that must not be missed."""
        self._told = [*(t for t in self._told if t != text), text][-SENTENCES_SHOWN:]
        self._silence_told = self.phase == "silent"

    def sentence_withdrawn(self, text: str) -> None:
        """A sentence no longer applies."""
        self._told = [t for t in self._told if t != text]

    def alarm_repeated(self, waited: float) -> None:
        """The reason for waiting is repeated after `waited` s."""
        self._reminder = reminder(waited)

    def view_changed(self, view: OperatorView) -> None:
        """The state of the engine changed."""
        if view.phase == "averaging" and self.phase != "averaging":
            self._told = self._told_before  # sentences about the turn no longer apply
        if view.phase == "taken":
            known = view.sigma[:3][np.isfinite(view.sigma[:3])]
            self.taken[view.hold.index] = float(known.max()) if len(known) else np.nan
            if view.reason.state is not WaitState.TAKEN_BEFORE:  # nothing is done then
                self._told = []
        if not alert(view):
            self._reminder = ""
        self.view, self.worked, self._silence_told = view, 0.0, False

    @property
    def is_worked_out(self) -> bool:
        """Whether a position is taken and what comes next is not known yet."""
        view = self.view
        return view is not None and view.hold is self.hold and view.phase == "taken"

    @property
    def left_out(self) -> frozenset[int]:
        """Numbers of the positions that the operator left out."""
        return self.view.left_out if self.view else frozenset()

    @property
    def phase(self) -> str:
        """Phase of the engine; empty before the first view."""
        return self.view.phase if self.view else ""

    @property
    def count(self) -> int:
        """Number of positions, with those that are known to follow."""
        known = len(self.positions)
        hold = self.hold
        return known if hold is None else max(known, hold.index + 1 + hold.further)

    @property
    def current_index(self) -> int:
        """Number of the position asked for, from 0; -1 before there is one."""
        return self.hold.index if self.hold else -1

    @property
    def instruction(self) -> Instruction:
        """The present instruction."""
        number = position_label(self.hold, self.count, self.most)
        return Instruction.of(self.hold, self.view, number, self.worked)

    @property
    def sentences(self) -> list[str]:
        """Sentences that must not be missed, and why the run waits.

        What was told of a silent device since it was seen to be silent says why as
        well, and more.
        """
        why = alert(self.view) if self.view and not self._silence_told else ""
        told = [text for text in self._told if text != why]
        return [*told, *([self._reminder + why] if why else [])]

    def position_state(self, i: int) -> str:
        """State of a position: "taken" with its ±, "now", "left out", or empty."""
        if i not in self.taken:
            waits = "left out" if i in self.left_out else ""
            return "now" if i == self.current_index else waits
        sigma = self.taken[i]
        return f"taken   ± {1e3 * sigma:.2f} mm/s²" if np.isfinite(sigma) else "taken"
