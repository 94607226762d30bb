"""Properties of a device from its first seconds: which way is up, what it sends.

Gravity shows which axis is up, and the mounting on the ladder that follows. The rates
at rest show whether the device removes their bias itself. A turn by hand shows their
unit.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fieldcal.core.frames import specific_force_at_home
from fieldcal.core.samples import Array, Block, split_by_time
from fieldcal.run.acc_unit import reads_gravity
from fieldcal.run.gyro_unit import GyroUnitWatch
from fieldcal.run.mounting_check import fitting_mounting, up_axis

PLAIN_MOUNTING = ("+x", "+y", "+z")
"""The mounting unless another is declared."""

ZERO_SIGMAS = 3.0
"""Rates at rest within so many standard errors of zero are taken as without bias."""

ZEROED_NOTICE = (
    "the rates are zero at rest: if the device takes their bias out itself (gyro bias"
    " estimation, zero velocity update), switch that off, as a bias that is taken out"
    " cannot be measured"
)
"""Notice about rates without a bias."""

PIECE_S = 0.1
"""Longest stretch that is processed at once, s."""


@dataclass(frozen=True, slots=True)
class DeviceIntroduction:
    """Properties of a device from its first seconds.

    Attributes
    ----------
    up : device axis that is up, as in "+z"; empty if none is, or if it reads no gravity
    mounting : mounting with which the device is at home; the plain one by default
    rates_zeroed : whether its rates are zero at rest, for no reason that it states
    summary : one sentence about all of them

    """

    up: str
    mounting: tuple[str, ...]
    rates_zeroed: bool
    summary: str


def introduce_device(
    block: Block, gravity: float, bias_stated: bool = False
) -> DeviceIntroduction:
    """Determine the properties of a device from samples at rest.

    Parameters
    ----------
    block : a second or more, SI, device axes
    gravity : m/s^2
    bias_stated : whether the device states what it takes out, so that it is put back

    """
    centred = not bias_stated and rates_are_zero(block.gyr)
    zero = f"; {ZEROED_NOTICE}" * centred
    if not np.isfinite(block.acc).any(axis=0).all():
        summary = "it sends no accelerations along all three axes"
        return DeviceIntroduction("", PLAIN_MOUNTING, centred, summary + zero)
    f: Array = np.nanmean(block.acc, axis=0)
    size = float(np.linalg.norm(f))
    if not reads_gravity(size, gravity):
        summary = f"it reads {size:.3g} m/s² at rest, and gravity is {gravity:.3g} m/s²"
        return DeviceIntroduction("", PLAIN_MOUNTING, centred, summary + zero)
    mounting = fitting_mounting(f, specific_force_at_home(gravity), PLAIN_MOUNTING)
    if mounting is None:
        return DeviceIntroduction("", PLAIN_MOUNTING, centred, "it stands askew" + zero)
    up = up_axis(f)
    return DeviceIntroduction(up, mounting, centred, f"{up} is up{zero}")


def rates_are_zero(gyr: Array) -> bool:
    """Whether rates (n, 3) at rest are zero on each axis, by their own noise."""
    known = gyr[np.isfinite(gyr).all(axis=1)]
    if len(known) < 2:
        return False
    noise = np.diff(known, axis=0).std(axis=0) / np.sqrt(2)
    error = noise / np.sqrt(len(known))
    # of one that sends nothing but zeros at rest both are zero
    return bool((np.abs(known.mean(axis=0)) <= ZERO_SIGMAS * error).all())


def rate_unit_from_turn(
    blocks: Iterable[Block], gravity: float, patience: float
) -> str | None:
    """Unit of rates that are taken for rad/s, from a turn; None without a turn.

    Parameters
    ----------
    blocks : while the device is turned by hand
    gravity : m/s^2
    patience : device time to wait for a turn, s

    """
    watch, began = GyroUnitWatch(gravity), np.nan
    for block in blocks:
        began = float(block.t[0]) if np.isnan(began) else began
        for piece in split_by_time(block, PIECE_S):
            watch.add(piece)
            if watch.unit:
                return watch.unit
        if block.t[-1] - began > patience:
            break
    return None
