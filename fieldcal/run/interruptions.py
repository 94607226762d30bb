"""What ends a window other than motion: a gap, a restart, the operator."""

from __future__ import annotations

from fieldcal.core.errors import Moved


class RepeatPosition(Exception):
    """The operator wants a position that was taken once more.

    Attributes
    ----------
    index : its number

    """

    def __init__(self, index: int) -> None:
        super().__init__(index)
        self.index = index


OFTEN = 3
"""Disturbed windows in one position from which the remedy is said as well."""


def restart_notice(moved: Moved, times: int) -> str:
    """Sentence about a window that was disturbed so many times."""
    said = f"{moved}; hold still, the window starts again"
    if times < OFTEN:
        return said
    return (
        f"{said}, disturbed {times} times now: fix the device better, or shelter it"
        " from the wind"
    )


def gap(last: float, now: float) -> Moved:
    """Samples are missing between two device times, s."""
    return Moved(
        f"no samples came between {last:.2f} s and {now:.2f} s: the window starts"
        " again; check the cable if it happens once more",
        last,
        "t",
    )


def restarted(now: float) -> Moved:
    """The device's clock began anew at a device time, s."""
    return Moved(
        f"the device started anew at {now:.2f} s: the window starts again; check its"
        " power if it happens once more",
        now,
        "t",
    )


def processed_anew(now: float) -> Moved:
    """The device has changed what it does to its samples, noticed at a time, s."""
    return Moved(
        f"the device changed its own calibration before {now:.2f} s, as autopilots do"
        " when they start",
        now,
        "t",
    )
