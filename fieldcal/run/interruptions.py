"""Interruptions of a window other than motion: gaps, restarts, operator's wishes."""

from __future__ import annotations

from fieldcal.core.errors import Moved
from fieldcal.core.samples import CHANNELS, Block
from fieldcal.drivers.driver import Driver


class RepeatPosition(Exception):
    """The operator wants to repeat a position that was taken.

    Attributes
    ----------
    index : number of the position

    """

    def __init__(self, index: int) -> None:
        super().__init__(index)
        self.index = index


class DeviceChanged(Moved):
    """The device restarted or changed its settings: earlier samples do not count."""


class WindowDisturbed(Exception):
    """A window was disturbed, and the part before the disturbance is kept.

    Attributes
    ----------
    moved : the disturbance
    kept : duration of the kept part, s

    """

    def __init__(self, moved: Moved, kept: float) -> None:
        super().__init__(str(moved))
        self.moved, self.kept = moved, kept


def kept_notice(
    moved: Moved | None, kept: float, seconds: float, dropped: float
) -> str:
    """Sentence about a window that continues after a disturbance; times in s."""
    said = f"{moved}; " if moved else ""
    if dropped:
        said += f"it lies otherwise than before: those {dropped:.0f} s do not count; "
    if kept:
        said += f"{kept:.0f} of {seconds:.0f} s are kept; "
    return f"{said}hold still, it goes on by itself"


REMEDY_FROM = 3
"""Number of disturbed windows in a position from which the notice states a remedy."""


def is_motion(moved: Moved) -> bool:
    """Whether a window was interrupted by motion, and not by the link or a restart."""
    return moved.axis in CHANNELS


def restart_notice(moved: Moved, times: int) -> str:
    """Sentence about a window that begins again.

    `times` is how often a window in this position was disturbed by motion.
    """
    said = f"{moved}; hold still, the window starts again"
    if times < REMEDY_FROM or not is_motion(moved):
        return said
    return (
        f"{said}, disturbed {times} times now: fix the device better, or shelter it"
        " from the wind"
    )


MAX_GAP_S = 0.5
"""Longest time without samples that a window may have, s."""

MOST_LOSS_RESTARTS = 2
"""Most windows of a position that begin again because of missing samples. A link that
always loses some would lose them in the next window as well."""


class SamplesLost(Moved):
    """A window lacks samples that the link has lost."""


class WindowWatch:
    """Watches for interruptions of a window other than motion: by link or device.

    Parameters
    ----------
    driver : of the device
    seconds : planned length of the window
    lost_share : share of its samples that may be missing

    """

    def __init__(self, driver: Driver, seconds: float, lost_share: float) -> None:
        self._driver, self._seconds, self._lost_share = driver, seconds, lost_share
        health = driver.health
        self._restarts, self._missing = health.restarts, health.missing
        self._changed = driver.read_back.changed
        self._first = self._last = float("nan")
        self._samples = 0

    def check(self, block: Block) -> None:
        """Check the samples that follow.

        Raises
        ------
        Moved
            If the window has to begin again.

        """
        now, health = float(block.t[0]), self._driver.health
        if now - self._last > MAX_GAP_S:
            raise _gap_error(self._last, now)
        if health.restarts != self._restarts:
            raise _restart_error(now)
        self.check_device_unchanged(now)
        if not self._samples:
            self._first = now
        self._samples, self._last = self._samples + len(block), float(block.t[-1])
        missing = health.missing - self._missing
        if missing > self._lost_share * self._expected(missing):
            raise SamplesLost(
                f"{missing} samples were lost before {now:.2f} s: check the cable if it"
                " happens once more",
                now,
                "t",
            )

    def check_device_unchanged(self, now: float) -> None:
        """Raise Moved if the device has changed what it does to its samples."""
        if self._driver.read_back.changed != self._changed:
            raise DeviceChanged(
                f"the device changed its own calibration before {now:.2f} s, as"
                " autopilots do when they start",
                now,
                "t",
            )

    def _expected(self, missing: int) -> float:
        """Expected number of samples of the whole window."""
        elapsed = max(self._last - self._first, 1e-9)
        return (self._samples + missing) * max(1.0, self._seconds / elapsed)


def _gap_error(last: float, now: float) -> Moved:
    """Error that samples are missing between two device times, s."""
    return Moved(
        f"no samples came between {last:.2f} s and {now:.2f} s: check the cable if it"
        " happens once more",
        last,
        "t",
    )


def _restart_error(now: float) -> DeviceChanged:
    """Error that the device restarted at a device time, s."""
    return DeviceChanged(
        f"the device started anew at {now:.2f} s: check its power if it happens once"
        " more",
        now,
        "t",
    )
