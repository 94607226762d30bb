"""What a device tells of itself in its first seconds: which way is up, what it sends.

Gravity says which of its axes is up and what mounting that would be on the ladder, the
rates at rest whether it takes their bias out itself, and a turn by hand in which unit
they are.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fieldcal.core.frames import force_home
from fieldcal.core.samples import Array, Block, pieces
from fieldcal.run.gyro_unit import GyroUnitWatch
from fieldcal.run.mounting_check import other_mounting, up_axis
from fieldcal.run.position_check import NORM

PLAIN = ("+x", "+y", "+z")
"""The mounting unless another is declared."""

ZERO = 3.0
"""Standard errors within which all rates at rest are zero, as no bias leaves them."""

ZEROED = (
    "; its rates are zero at rest: it takes their bias out itself; switch that off"
    " (gyro bias estimation, zero velocity update), or the result is NO-GO"
)
"""What is said of rates that have no bias."""

PIECE = 0.1
"""Longest stretch that is looked at as one, s."""


@dataclass(frozen=True, slots=True)
class Introduction:
    """What the first seconds tell.

    Attributes
    ----------
    up : device axis that is up, as in "+z"; empty where it stands askew, or reads no g
    mounting : by which it would stand at home; the plain one where it is so already
    centred : whether its rates are zero at rest
    says : one sentence

    """

    up: str
    mounting: tuple[str, ...]
    centred: bool
    says: str


def introduced(block: Block, gravity: float) -> Introduction:
    """What samples of a device at rest tell of it.

    Parameters
    ----------
    block : a second or more, SI, device axes
    gravity : m/s^2

    """
    f: Array = np.nanmean(block.acc, axis=0)
    size = float(np.linalg.norm(f))
    centred = _centred(block.gyr)
    zero = ZEROED * centred
    if not abs(size - gravity) <= NORM * gravity:
        says = f"it reads {size:.3g} m/s² at rest, and gravity is {gravity:.3g} m/s²"
        return Introduction("", PLAIN, centred, says + zero)
    mounting = other_mounting(f, force_home(gravity), PLAIN)
    if mounting is None:
        return Introduction("", PLAIN, centred, "it stands askew" + zero)
    up = up_axis(f)
    return Introduction(up, mounting, centred, f"{up} is up{zero}")


def _centred(gyr: Array) -> bool:
    """Whether rates (n, 3) at rest are zero on each axis, by their own noise."""
    known = gyr[np.isfinite(gyr).all(axis=1)]
    if len(known) < 2:
        return False
    noise = np.diff(known, axis=0).std(axis=0) / np.sqrt(2)
    error = noise / np.sqrt(len(known))
    return bool((noise > 0).all() and (np.abs(known.mean(axis=0)) < ZERO * error).all())


def unit_by_a_turn(
    blocks: Iterable[Block], gravity: float, patience: float
) -> str | None:
    """Unit in which rates are that are taken for rad/s; None if no turn told.

    Parameters
    ----------
    blocks : while the device is turned by hand
    gravity : m/s^2
    patience : device time to wait for a turn, s

    """
    watch, began = GyroUnitWatch(gravity), np.nan
    for block in blocks:
        began = float(block.t[0]) if np.isnan(began) else began
        for piece in pieces(block, PIECE):
            watch.add(piece)
            if watch.unit:
                return watch.unit
        if block.t[-1] - began > patience:
            break
    return None
