"""By how much the sensors lag behind the motion.

Accelerometers and gyroscopes follow with a time constant each, and the gyroscopes come
late against the accelerometers besides, all in s. Lags of several causes add up, which
of low-passes is so to first order in their time constants.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Lag:
    """Delay and time constants.

    Attributes
    ----------
    delay : s, of the gyroscopes against the accelerometers
    acc, gyr : s, time constants of the triads

    """

    delay: float = 0.0
    acc: float = 0.0
    gyr: float = 0.0

    def __add__(self, other: Lag) -> Lag:
        """Both together."""
        return Lag(self.delay + other.delay, self.acc + other.acc, self.gyr + other.gyr)
