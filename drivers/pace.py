"""The pace at which a recording is played: its time against the clock."""

from __future__ import annotations

from math import inf
from time import monotonic, sleep

from fieldcal.drivers.options import Options


def speed(options: Options) -> float:
    """Time of a recording against the clock; inf for ``speed=max``."""
    if options.text("speed") == "max":
        return inf
    return options.number("speed", 1.0, 1e-3, 1e6)


class Pace:
    """Follows the clock from the first time it is asked.

    Parameters
    ----------
    first : time at which the recording begins, s
    speed : its time against the clock; inf for as fast as it is read

    """

    def __init__(self, first: float, speed: float) -> None:
        self._first, self._speed = first, speed
        self._began: float | None = None

    def wait(self, t: float, timeout: float) -> float:
        """Wait until `t` is due, but `timeout` s at most; up to which time all is."""
        if self._speed == inf:
            return inf
        if self._began is None:
            self._began = monotonic()
        left = self._began + (t - self._first) / self._speed - monotonic()
        sleep(max(0.0, min(left, timeout)))
        return self._first + (monotonic() - self._began) * self._speed
