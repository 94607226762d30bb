"""Content of the page: the state of the run, in the words of the console."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from fieldcal.core.escaping import escape_invisible
from fieldcal.core.positions import Position
from fieldcal.planning.steps import Hold
from fieldcal.run.operator import widgets
from fieldcal.run.operator.content import RunContent
from fieldcal.run.operator.protocol import OperatorView


class Board:
    """State of the run, written by the run and read by the server's thread.

    Parameters
    ----------
    title : name of the run, and the folder it is recorded in
    positions : positions that will be asked for
    most : largest number of positions; None if `positions` has them all

    """

    def __init__(
        self, title: str, positions: Sequence[Position], most: int | None = None
    ) -> None:
        self._shown = RunContent(title, positions, most)
        self._ended: dict[str, Any] | None = None
        self._lock = threading.Lock()
        self._version = 0

    # -- written by the run

    def position_asked(self, hold: Hold) -> None:
        """A position is asked for."""
        with self._changed():
            self._shown.position_asked(hold)

    def sentence_told(self, text: str) -> None:
        """A sentence was told that must not be missed."""
        with self._changed():
            self._shown.sentence_told(text)

    def alarm_repeated(self, waited: float) -> None:
        """The reason for waiting is repeated after some time, s."""
        with self._changed():
            self._shown.alarm_repeated(waited)

    def view_changed(self, view: OperatorView) -> None:
        """The state of the engine changed."""
        with self._changed():
            self._shown.view_changed(view)

    def run_ended(self, words: str, sentences: Sequence[str], good: bool) -> None:
        """The run is over: GO, NO-GO, or why it stopped."""
        with self._changed():
            self._ended = {
                "words": words,
                "detail": "",
                "colour": "green" if good else "red",
                "told": [escape_invisible(text) for text in sentences],
            }

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

    @property
    def position_now(self) -> int | None:
        """Number of the position that is asked for; None before there is one."""
        with self._lock:
            return self._shown.hold.index if self._shown.hold else None

    def content(self) -> dict[str, Any]:
        """The whole state as JSON; texts are made safe for display."""
        with self._lock:
            run = self._shown
            now = run.instruction
            out: dict[str, Any] = {
                "title": escape_invisible(run.title),
                "ended": self._ended is not None,
                "words": now.words,
                "detail": now.detail,
                "colour": now.colour,
                "told": [escape_invisible(text) for text in run.sentences],
                "positions": [
                    {
                        "name": escape_invisible(position.name),
                        "state": run.position_state(i),
                    }
                    for i, position in enumerate(run.positions)
                ],
                "now": run.hold.index if run.hold else None,
                "wanted": _angles(run.hold.position) if run.hold else None,
            }
            if self._ended is not None:
                for shown in out["positions"]:
                    if shown["state"] == "now":
                        shown["state"] = ""  # no position is the one now
                return out | self._ended | {"now": None}
            if run.view is not None and run.view.hold is run.hold:
                out |= _measured(run.view)
        return out


def _angles(position: Position) -> dict[str, float] | None:
    """Alpha and beta, and gamma where there is a third angle, deg."""
    if position.all_degrees is None:
        return None
    alpha, beta, gamma = position.all_degrees
    third = {"gamma_deg": gamma} if gamma else {}
    return {"alpha_deg": alpha, "beta_deg": beta, **third}


def _measured(view: OperatorView) -> dict[str, Any]:
    """Present measurements."""
    out: dict[str, Any] = {
        "phase": view.phase,
        "link": escape_invisible(widgets.link_state(view).plain),
        "reason": "" if widgets.alert(view) else escape_invisible(view.reason.text),
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
