"""Draws the screen while the run calculates, so that it is seen to go on."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

REDRAWN_EACH_S = 1.0
"""Time between two drawings, s."""


class Redrawing:
    """Draws again and again, in a thread of its own, between `start` and `stop`.

    The run is at work meanwhile and changes nothing of what is drawn: whoever changes
    it stops the drawing first.

    Parameters
    ----------
    draw : draws once
    wait : waits for an event for so many seconds; returns whether it was set

    """

    def __init__(
        self,
        draw: Callable[[], None],
        wait: Callable[[Event, float], bool] = Event.wait,
    ) -> None:
        self._draw, self._wait = draw, wait
        self._thread: Thread | None = None
        self._stopped = Event()

    def start(self) -> None:
        """Begin to draw, the first time after `REDRAWN_EACH_S`."""
        self.stop()
        self._stopped = Event()
        self._thread = Thread(target=self._run, daemon=True, name="redrawing")
        self._thread.start()

    def stop(self) -> None:
        """Draw no more; returns when the last drawing is done."""
        thread, self._thread = self._thread, None
        if thread is not None:
            self._stopped.set()
            thread.join()

    @property
    def goes_on(self) -> bool:
        """Whether it draws."""
        return self._thread is not None

    def _run(self) -> None:
        while not self._wait(self._stopped, REDRAWN_EACH_S):
            self._draw()
