"""Lines of two sensors in turn: each beside the nearest of the other.

Nothing is interpolated.
"""

from __future__ import annotations

WAITING = 1000
"""Lines that wait for one of the gyroscope: it may end before."""


class NearestLines:
    """Puts each line of one sensor beside the nearest of the other."""

    def __init__(self) -> None:
        self._waiting: list[tuple[float, list[str]]] = []
        self._last: tuple[float, list[str]] | None = None
        self._before = self._step = float("nan")

    def force(self, t: float, row: list[str]) -> list[list[str]]:
        """Take a line of the accelerometer in; return those that wait in vain."""
        self._step = t - self._before if t > self._before else self._step
        self._before = t
        self._waiting.append((t, row))
        many = len(self._waiting) - WAITING
        late, self._waiting = (
            self._waiting[: max(many, 0)],
            self._waiting[max(many, 0) :],
        )
        return [self._beside(*one, None) for one in late]

    def rate(self, t: float, row: list[str]) -> list[list[str]]:
        """Take a line of the gyroscope in; return all that wait, each with one."""
        found = [self._beside(*one, (t, row)) for one in self._waiting]
        self._waiting, self._last = [], (t, row)
        return found

    def _beside(
        self, t: float, row: list[str], new: tuple[float, list[str]] | None
    ) -> list[str]:
        near = [one for one in (self._last, new) if one is not None]
        nearest = min(near, key=lambda one: abs(one[0] - t))
        # what is further than a step belongs to another line
        far = abs(nearest[0] - t) > self._step
        return [*row, *([""] * len(nearest[1]) if far else nearest[1])]
