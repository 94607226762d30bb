"""What the page has to show: the run as it stands, by the console's own words."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from rich.text import Text

from fieldcal.core.positions import Position
from fieldcal.core.shown import shown
from fieldcal.planning.steps import Hold
from fieldcal.run.operator import widgets
from fieldcal.run.operator.instruction import Instruction, numbered
from fieldcal.run.operator.protocol import OperatorView

TOLD = 2
"""Sentences that are kept in sight."""


class Board:
    """What there is to see, written by the run and read by the server's thread.

    Parameters
    ----------
    title : what is being done, and where it is recorded
    positions : all that will be asked for
    most : positions that there are at most, where they are found on the way

    """

    def __init__(
        self, title: str, positions: Sequence[Position], most: int | None = None
    ) -> None:
        self._title, self._positions, self._most = title, list(positions), most
        self._taken: dict[int, float] = {}
        self._told: list[str] = []
        self._reminder = ""
        self._hold: Hold | None = None
        self._view: OperatorView | None = None
        self._ended: dict[str, Any] | None = None
        self._lock = threading.Lock()
        self._version = 0

    # -- written by the run

    def asked(self, hold: Hold) -> None:
        """A position is asked for."""
        with self._changed():
            self._hold, self._view = hold, None
            self._told, self._reminder = self._told[-1:], ""
            self._taken.pop(hold.index, None)
            if hold.index >= len(self._positions):  # found on the way
                self._positions.append(hold.position)

    def told(self, text: str) -> None:
        """A sentence must not be missed."""
        with self._changed():
            kept = [t for t in self._told if t != text]
            self._told = [*kept, text][-TOLD:]

    def alarmed(self, reminder: str) -> None:
        """The reason for waiting is repeated with what stands before it."""
        with self._changed():
            self._reminder = reminder

    def seen(self, view: OperatorView) -> None:
        """The engine is at something."""
        with self._changed():
            if view.phase == "taken":
                known = view.sigma[:3][np.isfinite(view.sigma[:3])]
                sigma = float(known.max()) if len(known) else np.nan
                self._taken[view.hold.index], self._told = sigma, []
            self._view = view

    def ended(self, words: str, sentences: Sequence[str], good: bool) -> None:
        """The run is over: GO, NO-GO, or why it stopped."""
        with self._changed():
            colour = "green" if good else "red"
            self._ended = {"words": words, "colour": colour, "told": list(sentences)}

    @contextlib.contextmanager
    def _changed(self) -> Iterator[None]:
        with self._lock:
            yield
            self._version += 1  # last: who read it before has what it counts

    # -- read by the server

    @property
    def version(self) -> int:
        """A number that grows with every change."""
        return self._version

    def content(self) -> dict[str, Any]:
        """All there is to see, as JSON; text as it is shown, never carried out."""
        with self._lock:
            now = self._instruction()
            out: dict[str, Any] = {
                "title": self._title,
                "ended": self._ended is not None,
                "words": now.words,
                "detail": now.detail,
                "colour": now.colour,
                "told": self._sentences(),
                "positions": self._listed(),
                "now": self._hold.index if self._hold else None,
                "wanted": _angles(self._hold.position) if self._hold else None,
            }
            view = self._view
            if view is not None and self._ended is None:
                out |= _measured(view)
        told = self._ended["told"] if self._ended else out["told"]
        out["told"] = [shown(text) for text in told]
        return out

    def _instruction(self) -> Instruction:
        if self._ended is not None:
            return Instruction(self._ended["words"], "", self._ended["colour"])
        number = numbered(self._hold, len(self._positions), self._most)
        return Instruction.of(self._hold, self._view, number)

    def _sentences(self) -> list[str]:
        why = widgets.alert(self._view) if self._view else ""
        return [*self._told, *([self._reminder + why] if why else [])]

    def _listed(self) -> list[Mapping[str, Any]]:
        return [
            {
                "name": shown(position.name),
                "taken": f"± {1e3 * self._taken[i]:.2f} mm/s²"
                if np.isfinite(self._taken.get(i, np.nan))
                else "taken"
                if i in self._taken
                else "",
            }
            for i, position in enumerate(self._positions)
        ]


def _angles(position: Position) -> dict[str, float] | None:
    """Alpha and beta, deg."""
    if position.degrees is None:
        return None
    alpha, beta = position.degrees
    return {"alpha_deg": alpha, "beta_deg": beta}


def _measured(view: OperatorView) -> dict[str, Any]:
    """What is measured now."""
    out: dict[str, Any] = {
        "phase": view.phase,
        "link": _plain(widgets.link(view)),
        "reason": "" if widgets.alert(view) else view.reason.text,
        "still": bool(view.stillness < 1) if np.isfinite(view.stillness) else None,
    }
    if view.phase in ("averaging", "taken"):
        reached = widgets.sigma(view)
        out["elapsed_s"], out["seconds"] = round(view.elapsed, 1), view.hold.seconds
        out["reached"] = f"± {reached}" if reached else ""
    there = view.arrival
    if there is not None and np.isfinite(there.alpha_deg + there.beta_deg):
        out["there"] = {
            "alpha_deg": round(there.alpha_deg, 1),
            "beta_deg": round(there.beta_deg, 1),
            "ok": bool(there.ok),
        }
    return out


def _plain(text: Text) -> str:
    return shown(text.plain)
