"""A window as it fills: mean, error, stillness and verdict after every block."""

from __future__ import annotations

import numpy as np

from fieldcal.errors import InputError, Moved
from fieldcal.samples import CHANNELS, Array, Block
from fieldcal.windows.cells import Cells
from fieldcal.windows.disturbance import largest_deviation
from fieldcal.windows.limits import Limits
from fieldcal.windows.longrun import covariance_of_mean
from fieldcal.windows.mean import Average

SOONEST = 3.0
"""Shortest stretch whose own noise is known well enough to judge it, s."""


class Window:
    """A window of device time over which the device should be still.

    Feed it with `add`; every property holds for the samples so far, and none depends
    on how they were cut into blocks.
    """

    def __init__(self, limits: Limits | None = None) -> None:
        self._limits = limits or Limits()
        self._cells = Cells()

    def add(self, block: Block) -> None:
        """Take in the block that follows; costs as much as the block is long."""
        self._cells.add(block)

    @property
    def n(self) -> int:
        """Samples so far."""
        return self._cells.n

    @property
    def elapsed(self) -> float:
        """Device time so far, s."""
        return self._cells.end - self._cells.start if self.n else 0.0

    @property
    def mean(self) -> Array:
        """Mean so far, (6,); nan where not measured."""
        return self._cells.mean

    @property
    def sigma(self) -> Array:
        """Standard error of the mean so far, (6,); nan while too short to know."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def covariance(self) -> Array:
        """Covariance of the mean so far, (6, 6)."""
        return covariance_of_mean(self._cells.means)

    @property
    def temperature(self) -> float:
        """Mean temperature so far, deg C; nan where unknown."""
        return self._cells.temperature

    @property
    def motion(self) -> float:
        """Largest deviation so far, as part of what is allowed: above 1 it moved."""
        worst = largest_deviation(self._cells.means)
        return worst.ratio if worst else 0.0

    @property
    def moved(self) -> Moved | None:
        """The disturbance, if there was one; None while the window is good."""
        if self.elapsed < SOONEST:
            return self._beyond_limits()
        worst = largest_deviation(self._cells.means)
        if worst and worst.ratio > 1:
            return worst.error(self._cells.times)
        return self._beyond_limits()

    def _beyond_limits(self) -> Moved | None:
        means = self._cells.means
        if len(means) < 2:
            return None
        over = np.nan_to_num(np.nanstd(means, axis=0)) / self._limits.six
        channel = int(np.argmax(over))
        if over[channel] <= 1:
            return None
        axis = CHANNELS[channel]
        return Moved(
            f"moving on {axis}, {over[channel]:.1f} times what can be noise; put the "
            "device down, the window starts again",
            float(self._cells.times[int(np.argmax(np.abs(means[:, channel])))]),
            axis,
        )

    def done(self, target: float | None) -> str | None:
        """Return why averaging can stop before its time, as a sentence, or None.

        `target` is the standard error wanted of each accelerometer mean, m/s^2.
        """
        reached = float(np.max(np.nan_to_num(self.sigma[:3], nan=np.inf)))
        if target is None or reached > target:
            return None
        return (
            f"the means are known to {reached:.2g} m/s² after {self.elapsed:.0f} s, "
            f"{target:.2g} m/s² was wanted"
        )

    def average(self) -> Average:
        """Return the mean and its error.

        Raises
        ------
        Moved
            If the window was disturbed.
        InputError
            If there are fewer than two cells of samples.

        """
        if len(self._cells) < 2:
            raise InputError(
                f"a window of {self.n} samples in {self.elapsed:.2g} s is too short to "
                "average: take at least 0.2 s"
            )
        if moved := self.moved:
            raise moved
        return Average(
            self.mean,
            self.covariance,
            self.temperature,
            self.n,
            self._cells.start,
            self._cells.end,
        )


def average(block: Block, limits: Limits | None = None) -> Average:
    """Average a window of samples.

    Raises
    ------
    Moved
        If the window was disturbed; with the instant and the axis.
    InputError
        If it is too short to have an error.

    """
    window = Window(limits)
    window.add(block)
    return window.average()
