"""Wishes while a mover turns the device: a turn that was begun is never broken off.

A turntable whose program is killed half way goes on, or stands anywhere, while the next
order reaches it. So what would begin another turn waits until this one is done. A
confirmation is dropped: what it would confirm is not there yet.
"""

from __future__ import annotations

from fieldcal.run.operator.protocol import Wish

DEFERRED: dict[Wish, str] = {"repeat": "r", "skip": "s"}
"""Wishes that begin another turn, and their keys."""


class WishesWhileTurning:
    """Keeps the last wish that has to wait for the mover.

    Attributes
    ----------
    kept : the wish, None if there is none

    """

    def __init__(self) -> None:
        self.kept: Wish | None = None

    def wish(self, pressed: Wish | None, turning: bool) -> Wish | None:
        """The wish that may be carried out now; "wait" while the mover turns."""
        if pressed == "stop":
            return pressed
        if pressed in DEFERRED:
            self.kept = pressed
        if turning:
            return "wait"
        kept, self.kept = self.kept, None
        return kept or pressed

    def notice(self, pressed: Wish | None, turning: bool) -> str:
        """What is said of a key at its press; empty if it needs no word."""
        if not turning or pressed is None or pressed == "stop":
            return ""
        if pressed in DEFERRED:
            return f"{DEFERRED[pressed]} counts once the mover is done; q ends at once"
        return "not yet: the mover is still at work"
