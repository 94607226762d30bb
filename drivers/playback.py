"""Speed at which a recording is played back."""

from __future__ import annotations

from math import inf
from time import monotonic, sleep

from fieldcal.drivers.options import Options


def playback_speed(options: Options) -> float:
    """Speed from the options: device time over host time; inf for ``speed=max``."""
    if options.text("speed") == "max":
        return inf
    return options.number("speed", 1.0, 1e-3, 1e6)


class PlaybackClock:
    """Maps host time to the time of a recording, from the first call of `wait` on.

    Parameters
    ----------
    first : time at which the recording begins, s
    speed : its time over host time; inf for as fast as possible

    """

    def __init__(self, first: float, speed: float) -> None:
        self._first, self._speed = first, speed
        self._began: float | None = None

    def wait(self, t: float, timeout: float) -> float:
        """Wait until `t` is due, at most `timeout` s; return the time due, s."""
        if self._speed == inf:
            return inf
        if self._began is None:
            self._began = monotonic()
        left = self._began + (t - self._first) / self._speed - monotonic()
        sleep(max(0.0, min(left, timeout)))
        return self._first + (monotonic() - self._began) * self._speed
