"""Reads what an autopilot has installed again and again, and tells whether it changed.

An autopilot changes its own calibration: it averages its gyroscopes at each start
(ArduPilot's INS_GYR_CAL) or at rest (PX4's SENS_IMU_AUTOCAL), and somebody else may set
a parameter meanwhile. So one reading holds for the samples before it only if the next
one says the same.

A *round* asks for every parameter; after a restart `STABLE` rounds in a row must agree,
since the first may come from before the gyroscopes were averaged. No I/O and no clock.
"""

from __future__ import annotations

from collections.abc import Mapping

from fieldcal.drivers.mavlink_installed import Installed, names

STABLE = 2
"""Rounds in a row that must say the same after a restart."""

CLOSE = 1e-6
"""Relative difference of a value that is the same: it travels in 32 bits."""


class InstalledWatch:
    """Rounds of questions for the installed calibration of one sensor.

    Parameters
    ----------
    installed : what is known, which is kept up to date

    Attributes
    ----------
    readings : rounds that said what was known before
    changes : rounds that said something else
    answers : whether it has ever answered for all parameters

    """

    def __init__(self, installed: Installed) -> None:
        self.installed = installed
        known = names(installed.autopilot, installed.instance)
        self._names = {name for some in known.values() for name in some}
        self._heard: dict[str, float] = {}
        self._left = STABLE if self._names else 0
        self.readings = self.changes = 0
        self.answers = not self._names

    @property
    def waits(self) -> bool:
        """Whether a round is under way."""
        return self._left > 0

    @property
    def open(self) -> list[str]:
        """Parameters that this round has not heard yet."""
        return sorted(self._names - self._heard.keys())

    def again(self, rounds: int = 1) -> None:
        """Begin anew: what comes from now on counts, until so many rounds agree."""
        self._heard = {}
        self._left = max(self._left, rounds) if self._names else 0

    def give_up(self) -> None:
        """Ask no more: it does not answer; what it did say is known."""
        self._left = 0
        self.installed.values |= self._heard

    def hear(self, name: str, value: float) -> bool:
        """Take note of a value; whether it ends a round."""
        if name not in self._names:
            return False
        if self.answers and not self.waits:
            if close(self.installed.used.get(name), value):
                return False
            self.again(STABLE)  # it was told unasked that something has changed
        self._heard[name] = value
        if self.open:
            return False
        self._end()
        return True

    def _end(self) -> None:
        """Compare what a round has heard with what was known."""
        used = self.installed.used
        if self.answers and all(close(used.get(n), v) for n, v in self._heard.items()):
            self.readings += 1
            self._left -= 1
        else:
            self.changes += self.answers
            self._left = max(self._left, STABLE) - 1
        self.answers = True
        self._know(self._heard)
        self._heard = {}

    def _know(self, heard: Mapping[str, float]) -> None:
        self.installed.used = dict(heard)
        if not self.installed.taken_out:
            self.installed.values |= heard


def close(kept: float | None, value: float) -> bool:
    """Whether a parameter is what it was.

    >>> close(0.1, 0.10000000149), close(0.1, 0.1001), close(None, 0.1)
    (True, False, False)
    """
    if kept is None:
        return False
    both_unknown = kept != kept and value != value
    return both_unknown or abs(kept - value) <= CLOSE * abs(value)
