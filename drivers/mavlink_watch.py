"""Reads the installed calibration of an autopilot repeatedly, and detects changes.

An autopilot changes its own calibration: it averages its gyroscopes at each start
(ArduPilot's INS_GYR_CAL) or at rest (PX4's SENS_IMU_AUTOCAL), and somebody else may set
a parameter meanwhile. So one reading holds for the samples before it only if the next
one says the same.

A *round* asks for every parameter; after a restart `STABLE_ROUNDS` rounds in a row must
agree, since the first may come from before the gyroscopes were averaged. No I/O and no
clock.
"""

from __future__ import annotations

from collections.abc import Mapping

from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import parameter_names

STABLE_ROUNDS = 2
"""Successive rounds that must agree after a restart."""

RELATIVE_TOLERANCE = 1e-6
"""Relative difference of equal values, which are sent in 32 bits."""


class InstalledWatch:
    """Rounds of requests for the installed calibration of one sensor.

    Parameters
    ----------
    installed : the calibration to keep up to date

    Attributes
    ----------
    readings : rounds without a change
    changes : rounds with a change
    has_answered : whether all parameters were ever received

    """

    def __init__(self, installed: InstalledCalibration) -> None:
        self.installed = installed
        known = parameter_names(installed.autopilot, installed.instance)
        self._names = {name for some in known.values() for name in some}
        self._heard: dict[str, float] = {}
        self._left = STABLE_ROUNDS if self._names else 0
        self.readings = self.changes = 0
        self.has_answered = not self._names

    @property
    def is_reading(self) -> bool:
        """Whether a round is under way."""
        return self._left > 0

    @property
    def unheard(self) -> list[str]:
        """Parameters that this round has not received yet."""
        return sorted(self._names - self._heard.keys())

    def start_over(self, rounds: int = 1) -> None:
        """Start a new round; read until so many rounds agree."""
        self._heard = {}
        self._left = max(self._left, rounds) if self._names else 0

    def give_up(self) -> None:
        """Stop reading without an answer; values received so far are kept."""
        self._left = 0
        self.installed.values |= self._heard

    def hear(self, name: str, value: float) -> bool:
        """Process a value; returns whether it completes a round."""
        if name not in self._names:
            return False
        if self.has_answered and not self.is_reading:
            if is_unchanged(self.installed.in_samples.get(name), value):
                return False
            self.start_over(STABLE_ROUNDS)  # an unrequested value shows a change
        self._heard[name] = value
        if self.unheard:
            return False
        self._end()
        return True

    def _end(self) -> None:
        """Compare the values of a round with the known ones."""
        used = self.installed.in_samples
        if self.has_answered and all(
            is_unchanged(used.get(n), v) for n, v in self._heard.items()
        ):
            self.readings += 1
            self._left -= 1
        else:
            self.changes += self.has_answered
            self._left = max(self._left, STABLE_ROUNDS) - 1
        self.has_answered = True
        self._know(self._heard)
        self._heard = {}

    def _know(self, heard: Mapping[str, float]) -> None:
        self.installed.in_samples = dict(heard)
        if not self.installed.taken_out:
            self.installed.values |= heard


def is_unchanged(kept: float | None, value: float) -> bool:
    """Whether a parameter has its earlier value; both may be nan.

    >>> [is_unchanged(kept, 0.1) for kept in (0.10000000149, 0.1001, None)]
    [True, False, False]
    """
    if kept is None:
        return False
    both_unknown = kept != kept and value != value
    return both_unknown or abs(kept - value) <= RELATIVE_TOLERANCE * abs(value)
