"""A device that was lost: opened again, and heard, before the run goes on.

A port that can be opened says nothing of the device behind it. Until samples come, the
operator is not asked for anything, and no mover is told to turn.
"""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic, sleep

from fieldcal.core.errors import DeviceError, LinkLost, Stopped
from fieldcal.drivers.driver import Driver, LinkHealth
from fieldcal.run.companions import LeadRecorder
from fieldcal.run.operator.protocol import Operator
from fieldcal.session.recorder import Recorder

RETRY_S = 0.5
"""Time between two attempts to open the device again, or to hear it, s."""


class Reconnection:
    """Opens a device again until samples come from it.

    Parameters
    ----------
    opened : opens the device
    operator : who turns it, and may end the run
    recorder : the session folder

    """

    def __init__(
        self,
        opened: Callable[[], Driver],
        operator: Operator,
        recorder: Recorder | LeadRecorder,
    ) -> None:
        self._opened, self._operator, self._recorder = opened, operator, recorder
        self._driver: Driver | None = None
        self._told = ""

    def wait(self, lost: DeviceError, deadline: float) -> Driver:
        """Return the device once it is heard; `deadline` is as of `monotonic`.

        Raises
        ------
        DeviceError
            The error by which it was lost, if it does not come back.
        Stopped
            If the operator ends the run.

        """
        self._recorder.mark("lost", text=str(lost))
        if (left := deadline - monotonic()) > 0:
            said = lost.fault if isinstance(lost, LinkLost) else str(lost)
            self._operator.tell(
                f"{said}; goes on by itself once it is back, within {left:.0f} s; if"
                " it has another port now (fieldcal ports), end this (q), resume there"
            )
        try:
            while monotonic() < deadline:
                if driver := self._heard_driver():
                    self._recorder.link_reopened()
                    self._operator.tell(f"samples come from {driver.name} again")
                    return driver
                if self._operator.wish() == "stop":
                    raise Stopped("stopped by the operator")
        finally:
            self._close()
        raise lost

    def _heard_driver(self) -> Driver | None:
        """The device if it sends; it stays open while it does not."""
        try:
            self._driver = self._driver or self._opened()
            if self._driver.speaks(RETRY_S):
                heard, self._driver = self._driver, None
                return heard
            self._tell_other_bytes(self._driver)
        except DeviceError:
            self._close()
            sleep(RETRY_S)
        return None

    def _tell_other_bytes(self, driver: Driver) -> None:
        """Say once what comes in place of samples, as at another baud rate."""
        if not driver.health.received:
            return
        why = driver.why_silent(LinkHealth())
        if why != self._told:
            self._told = why
            self._operator.tell(f"no samples come from {driver.name}: {why}")

    def _close(self) -> None:
        if self._driver is not None:
            self._driver.close()
            self._driver = None
