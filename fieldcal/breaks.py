"""What breaks a window off beside a movement: a gap, a restart, the operator."""

from __future__ import annotations

from fieldcal.errors import Moved


class Again(Exception):
    """The operator wants a position that was taken once more.

    Attributes
    ----------
    index : its number

    """

    def __init__(self, index: int) -> None:
        super().__init__(index)
        self.index = index


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
