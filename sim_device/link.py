"""What every link is: a way to the host that carries what a virtual device sends.

To add one, write sim_device/link_<name>.py with a subclass of `Link`. A link never
blocks: what the host has not taken yet stays pending, and the stream decides whether
the device waits for the host, or goes on as a real one does.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from fieldcal.core.samples import Block


class Link(ABC):
    """Connection to one host."""

    @property
    @abstractmethod
    def address(self) -> str:
        """What a host has to open."""

    @abstractmethod
    def fileno(self) -> int:
        """File to watch; -1 while there is none."""

    @abstractmethod
    def attached(self) -> bool:
        """Whether a host listens."""

    @abstractmethod
    def send(self, block: Block) -> None:
        """Queue samples for the host."""

    @property
    @abstractmethod
    def pending(self) -> int:
        """Bytes that the host has not taken yet."""

    @abstractmethod
    def pump(self) -> None:
        """Pass on what the host takes now, and hear what it says.

        Raises
        ------
        DeviceError
            If the link has failed for good.

        """

    @abstractmethod
    def linger(self, seconds: float) -> None:
        """Wait, at most so long, until the host has read everything."""

    @abstractmethod
    def hang_up(self) -> None:
        """Break the link, as a pulled plug does."""

    @abstractmethod
    def come_back(self) -> None:
        """Be there again after `hang_up`; `address` may be another."""

    def reboot(self) -> None:
        """Forget what the host has asked the device for; most are asked for nothing."""
        return

    @abstractmethod
    def close(self) -> None:
        """Release everything; safe to call twice."""
