"""What the sensors of a triad make of the motion of a reference.

They are late by a delay, and follow with a low-pass of first and one of second order.
Where a time constant is below the least that a motion of a body tells from a delay,
the derivatives (5) and (6) of `fieldcal.model.rows.low_pass` are those at the least, L.
What tells a time constant from a delay goes as its square in the first order and as its
cube in the second. A step of the derivative from tau to tau' therefore leads to

    tau |tau| + (|tau| + max(|tau|, L)) (tau' - tau)            squared             (1)
    tau^3 + 3 max(|tau|, L)^2 (tau' - tau)                      cubed               (2)

and what it is more than that is a delay: by tau, or sqrt(2) tau in the second order.
Where no delay is free, that of the filter tells its time constant, and the step to tau'
is right as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from fieldcal.core.samples import CHANNELS
from fieldcal.model import detections
from fieldcal.model.rows.low_pass import (
    ROOT2,
    first_order,
    first_order_slope,
    second_order,
    second_order_slope,
)
from fieldcal.model.rows.reference import Reference

SIX = range(len(CHANNELS))
"""All channels."""


@dataclass(frozen=True, slots=True)
class Response:
    """Response of the sensors of a triad to the motion of a reference.

    Attributes
    ----------
    late : delay, s
    tau : time constant of the low-pass of first order, s
    second : time constant of the low-pass of second order, s
    sensed : the reference after both low-passes
    slope, bend : decrease of `sensed` per second of `tau` and of `second`, of some
        channels; that of others is not calculated
    channels : these, of the six

    """

    late: float
    tau: float
    second: float
    sensed: Reference
    slope: Reference
    bend: Reference
    channels: range

    @classmethod
    def of(
        cls,
        reference: Reference,
        late: float = 0.0,
        tau: float = 0.0,
        second: float = 0.0,
        channels: range = SIX,
    ) -> Self:
        """Response to a reference with a delay and time constants."""
        sensed = low_passed(reference, tau, second)
        slope = partial(
            first_order_slope, tau=max(abs(tau), detections.MIN_TIME_CONSTANT_S)
        )
        bend = partial(
            second_order_slope, tau=max(abs(second), detections.MIN_SECOND_ORDER_S)
        )
        own = sensed.select_channels(channels)
        return cls(
            late, tau, second, sensed, own.filtered_by(slope), own.filtered_by(bend),
            channels,
        )  # fmt: skip

    def follow(self, reference: Reference) -> Reference:
        """Another reference after the low-passes."""
        return low_passed(reference, self.tau, self.second)

    def step_towards(
        self,
        reference: Reference,
        late: float,
        tau: float,
        second: float,
        free: bool = True,
        channels: range = SIX,
    ) -> Self:
        """Response after a step towards an estimated delay and time constants, s.

        If the delay is `free`, the time constants are those of (1) and (2), and their
        difference from the estimate is added to the delay.
        """
        first, other = tau, second
        if free:
            first, other = self._first_towards(tau), self._second_towards(second)
        late += tau - first + ROOT2 * (second - other)
        if (first, other, channels) == (self.tau, self.second, self.channels):
            return replace(self, late=late)
        return self.of(reference, late, first, other, channels)

    def _first_towards(self, tau: float) -> float:
        if not tau:
            return 0.0
        now = self.tau
        square = now * abs(now) + (
            abs(now) + max(abs(now), detections.MIN_TIME_CONSTANT_S)
        ) * (tau - now)  # (1)
        return float(np.sign(square) * np.sqrt(abs(square)))

    def _second_towards(self, second: float) -> float:
        if not second:
            return 0.0
        now = self.second
        step = 3 * max(abs(now), detections.MIN_SECOND_ORDER_S) ** 2 * (second - now)
        return float(np.cbrt(now**3 + step))  # (2)

    def distance_to(self, other: Self) -> float:
        """Largest difference of the time constants, relative to the least ones."""
        return max(
            abs(self.tau - other.tau) / detections.MIN_TIME_CONSTANT_S,
            abs(self.second - other.second) / detections.MIN_SECOND_ORDER_S,
        )


def low_passed(reference: Reference, tau: float, second: float) -> Reference:
    """A reference after low-passes of first and second order, if there are any."""
    if tau:
        reference = reference.filtered_by(partial(first_order, tau=tau))
    if second:
        reference = reference.filtered_by(partial(second_order, tau=second))
    return reference
