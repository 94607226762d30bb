"""Lines of two sensors in one text: each beside the nearest of the other.

Lines of both may come one by one or many of one at a time, as telephones hand samples
over. Nothing is interpolated.
"""

from __future__ import annotations

from collections import deque

WAITING = 1000
"""Lines of either sensor that wait for the other: it may end before."""


class NearestLines:
    """Puts each line of the accelerometer beside the nearest of the gyroscope.

    Parameters
    ----------
    width : cells of a line of the gyroscope

    """

    def __init__(self, width: int) -> None:
        self._width = width
        self._waiting: deque[tuple[float, list[str]]] = deque()
        self._rates: deque[tuple[float, list[str]]] = deque()
        self._before = self._step = float("nan")

    def force(self, t: float, row: list[str]) -> list[list[str]]:
        """Take a line of the accelerometer in; return those whose nearest is known."""
        anew = self.rest() if t < self._before else []
        self._step = t - self._before if t > self._before else self._step
        self._before = t
        self._waiting.append((t, row))
        return anew + self._ready()

    def rate(self, t: float, row: list[str]) -> list[list[str]]:
        """Take a line of the gyroscope in; return those whose nearest is known."""
        anew = self.rest() if self._rates and t < self._rates[-1][0] else []
        self._rates.append((t, row))
        found = anew + self._ready()
        if len(self._rates) > WAITING:
            self._rates.popleft()
        return found

    def rest(self) -> list[list[str]]:
        """Return all lines that wait: what comes behind, if anything, begins anew."""
        found = [self._beside(*one) for one in self._waiting]
        self._waiting.clear()
        self._rates.clear()
        return found

    def _ready(self) -> list[list[str]]:
        found, waiting = [], self._waiting
        until = self._rates[-1][0] if self._rates else float("-inf")
        while waiting and (waiting[0][0] <= until or len(waiting) > WAITING):
            found.append(self._beside(*waiting.popleft()))
        return found

    def _beside(self, t: float, row: list[str]) -> list[str]:
        rates = self._rates
        while len(rates) > 1 and (
            rates[1][0] <= t or abs(rates[1][0] - t) < abs(rates[0][0] - t)
        ):
            rates.popleft()
        # what is further than a step belongs to another line
        far = not rates or abs(rates[0][0] - t) > self._step
        return [*row, *([""] * self._width if far else rates[0][1])]
