"""What cannot be a device at rest, whatever its noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.samples import Array


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds of sanity on the noise itself; stillness is judged against the noise.

    A device on a running vehicle or in a hand stays below them, one that is being
    carried about does not.

    Attributes
    ----------
    acc : m/s^2, largest standard deviation of 0.1 s means of a device at rest
    gyr : rad/s, likewise

    """

    acc: float = 0.5
    gyr: float = 0.1

    @property
    def six(self) -> Array:
        """Bound of each channel, (6,)."""
        return np.repeat([self.acc, self.gyr], 3)
