"""Delay and time constants of the sensors behind the motion.

Accelerometers and gyroscopes follow with low-passes of first and of second order, and
the gyroscopes come late against the accelerometers besides, all in s; and samples come
before or after their stamps. Lags of several causes add up, which of low-passes is so
to first order in their time constants.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Lag:
    """Delay and time constants.

    Attributes
    ----------
    delay : s, of the gyroscopes against the accelerometers
    acc, gyr : s, time constants of first order of the triads
    acc_second, gyr_second : s, those of second order
    stamps : share of what stamps are off even times by that is their error

    """

    delay: float = 0.0
    acc: float = 0.0
    gyr: float = 0.0
    acc_second: float = 0.0
    gyr_second: float = 0.0
    stamps: float = 0.0

    def __add__(self, other: Lag) -> Lag:
        """Sum of both."""
        names = self.__slots__
        return Lag(*(getattr(self, name) + getattr(other, name) for name in names))
