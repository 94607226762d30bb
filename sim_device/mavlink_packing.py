"""What an autopilot makes of samples: MAVLink's IMU messages, with their rounding.

    RAW_IMU, SCALED_IMU, 2, 3   int16 in mg and mrad/s, cut toward zero; 0.01 deg C
    HIGHRES_IMU                 float32 in m/s^2, rad/s and deg C, of the barometer

Source: MAVLink common messages; the cut is what a cast in C does.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.sim_device.earth import STANDARD_GRAVITY

HIGHRES, RAW, SCALED = 105, 27, (26, 116, 129)
FULL = 2**15

ACC_UNITS = {"mg": 1e3 / STANDARD_GRAVITY, "mm/s^2": 1e3}
"""Whole numbers to 1 m/s^2: most programs send the first, some the other."""

BAROMETER_K = 9.0
"""By how much the barometer is warmer, K."""

ALL_BUT_PRESSURE = 0x11FF
"""Fields of HIGHRES_IMU that are new: three triads, and the temperature."""


def whole(values: Array) -> Array:
    """Cut toward zero into 16 bits."""
    return np.clip(np.trunc(values), -FULL, FULL - 1).astype(int)


def centidegrees(degrees: Array) -> Array:
    """Temperature in 0.01 deg C; 0 is kept for a sensor that has none."""
    centi = whole(np.nan_to_num(degrees) * 100)
    return np.where(np.isnan(degrees), 0, np.where(centi == 0, 1, centi))


def messages(
    dialect: Any, number: int, block: Block, acc_unit: str = "mg", instance: int = 0
) -> Iterator[Any]:
    """Make a message of each sample.

    Parameters
    ----------
    dialect : pymavlink's module
    number : of the message
    block : what the sensor puts out
    acc_unit : of the messages in whole numbers
    instance : number of the sensor, for messages that name it

    """
    make = dialect.mavlink_map[number]
    if number == HIGHRES:
        us, no_field = np.rint(block.t * 1e6).astype(int).tolist(), (0.0,) * 6
        degrees = np.nan_to_num(block.temperature + BAROMETER_K).tolist()
        for t, six, warm in zip(us, block.six.tolist(), degrees, strict=True):
            yield make(t, *six, *no_field, warm, ALL_BUT_PRESSURE, instance)
        return
    acc, gyr = whole(block.acc * ACC_UNITS[acc_unit]), whole(block.gyr * 1e3)
    field = (200, 0, -400)
    six = np.hstack([acc, gyr]).tolist()
    centi = centidegrees(block.temperature).tolist()
    if number == RAW:
        us = np.rint(block.t * 1e6).astype(int).tolist()
        for t, row, warm in zip(us, six, centi, strict=True):
            yield make(t, *row, *field, instance, warm)
    else:
        ms = (np.floor(block.t * 1e3 + 1e-6).astype(int) % 2**32).tolist()
        for t, row, warm in zip(ms, six, centi, strict=True):
            yield make(t, *row, *field, warm)
