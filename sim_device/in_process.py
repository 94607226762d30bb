"""A virtual device in the same process: a driver without a port or a clock."""

from __future__ import annotations

from typing import Protocol

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.drivers.driver import Driver, LinkHealth
from fieldcal.sim_device.device import VirtualDevice

BLOCK_S = 0.1


class PositionLike(Protocol):
    """A position: angles in rad, a constant rate in rad/s."""

    @property
    def alpha(self) -> float | None:
        """Turn about z, rad."""

    @property
    def beta(self) -> float | None:
        """Turn about the turned x, rad."""

    @property
    def gamma(self) -> float:
        """Turn about the twice turned y, rad."""

    @property
    def rate(self) -> tuple[float, float, float] | None:
        """Constant rate about the procedure axes, rad/s."""


class InProcess(Driver):
    """Driver of a device in the same process, which calls move and sample."""

    def __init__(self, device: VirtualDevice) -> None:
        self.device = device
        self.name = "virtual device"
        self.health = LinkHealth()
        self._n = max(1, round(BLOCK_S * device.rate))

    def receive(self, timeout: float) -> Block | None:
        """Return the next 0.1 s of samples at once; none if there is no time for it."""
        if timeout <= 0:
            return None
        block = self.device.take(self._n)
        self.health.samples += len(block)
        return block

    def host_time(self) -> float:
        """The device's own time: nothing waits between it and the reader."""
        return self.device.time

    def close(self) -> None:
        """Nothing to release."""

    def place(self, position: PositionLike) -> float:
        """Turn the device; returns the device time at which it is there, s.

        Raises
        ------
        InputError
            If the position has neither angles nor a rate.

        """
        if position.alpha is None or position.beta is None:
            if position.rate is None:
                raise InputError("the virtual device needs the angles of a position")
            return self.device.spin(position.rate)
        if position.rate is not None:
            angles = (position.alpha, position.beta, position.gamma)
            return self.device.spin(position.rate, angles)
        return self.device.turn(position.alpha, position.beta, gamma=position.gamma)
