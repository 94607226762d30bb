"""Buttons of the page. One client at a time may press them; all may watch."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from time import monotonic
from typing import get_args

from fieldcal.run.operator.protocol import Wish

GONE_AFTER_S = 15.0
"""Time without contact after which a client loses the buttons, s."""

OFFERED = frozenset(get_args(Wish)) - {"wait"}
"""Wishes that the page offers."""


class Buttons:
    """The buttons, and the client that holds them.

    Parameters
    ----------
    clock : returns the time, s

    """

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock, self._lock = clock, threading.Lock()
        self._holder, self._heard = "", 0.0
        self._pressed: deque[Wish] = deque(maxlen=1)

    def note_watcher(self, client: str) -> bool:
        """Note that a client watches; returns whether it holds the buttons."""
        with self._lock:
            if client == self._holder:
                self._heard = self._clock()
            return client == self._holder

    def is_free(self) -> bool:
        """Whether no present client holds the buttons."""
        with self._lock:
            return self._free()

    def _free(self) -> bool:
        return not self._holder or self._clock() - self._heard > GONE_AFTER_S

    def take(self, client: str, over: bool = False) -> bool:
        """Take the buttons; from another client only if `over`."""
        with self._lock:
            if client != self._holder and not (over or self._free()):
                return False
            self._holder, self._heard = client, self._clock()
            return True

    def press(self, client: str, wish: Wish) -> bool:
        """Press a button; False if another client holds them."""
        with self._lock:
            if client != self._holder:
                return False
            self._heard = self._clock()
            if "stop" not in self._pressed:  # whoever wants to stop wants no more
                self._pressed.append(wish)
            return True

    def pressed(self) -> Wish | None:
        """The last wish since the last call; None without one."""
        with self._lock:
            return self._pressed.pop() if self._pressed else None

    def forget(self) -> None:
        """Discard wishes so far, meant for an earlier step; a stop is for all."""
        with self._lock:
            if "stop" not in self._pressed:
                self._pressed.clear()
