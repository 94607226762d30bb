"""Calibrations in a FIT file, by which counts of its sensors become g and deg/s.

    a = R (c - s - o) f / d                                                        (1)

with counts c, the shift s of their zero, the offset o of each axis, the factor f and
its divisor d, and the matrix R, which turns the axes of the chip into the device's: of
the two sensors it differs. Source: message three_d_sensor_calibration of the profile,
and what the SDK makes of it (thisisant.com/forum/viewthread/7017; a message of a VIRB
Ultra 30 at forums.garmin.com/developer/fit-sdk/f/discussion/257689, whose matrix counts
65535 in one).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.text.text_top import is_number

MESSAGE = "three_d_sensor_calibration"

SENSORS = {"0": "accel", "1": "gyro", "accelerometer": "accel", "gyroscope": "gyro"}
"""Sensors by the number that a message has, or its name."""

ONE = 65535.0
"""What stands for 1 in a matrix of whole numbers."""

LARGEST = 3.0
"""Beyond the elements of any matrix that turns."""


class FitCalibration(NamedTuple):
    """Calibration of a sensor.

    Attributes
    ----------
    zero : (3,) counts
    matrix : (3, 3) g or deg/s of the device's axes in one count of the sensor's

    """

    zero: Array
    matrix: Array

    @classmethod
    def of(cls, fields: Mapping[str, str], within: str) -> FitCalibration | None:
        """By the fields of a message, whose values are parted; None if it lacks one."""
        names = ("calibration_factor", "accel_cal_factor", "gyro_cal_factor")
        factor = [fields[name] for name in names if name in fields]
        needed = ("calibration_divisor", "level_shift", "offset_cal",
                  "orientation_matrix")  # fmt: skip
        if not factor or any(name not in fields for name in needed):
            return None
        texts = [factor[0].split(within), *(fields[n].split(within) for n in needed)]
        if not all(is_number(text, False) for row in texts for text in row):
            return None
        values = [np.array(row, float) for row in texts]
        if [len(row) for row in values] != [1, 1, 1, 3, 9] or not values[1].all():
            return None
        turn = values[4].reshape(3, 3)
        turn = turn / ONE if np.abs(turn).max() > LARGEST else turn
        return cls(values[2] + values[3], turn * (values[0] / values[1]))

    def apply(self, rows: Sequence[Sequence[str]]) -> list[list[str]]:
        """Values of counts, by (1); empty where one is no number."""
        if not all(is_number(cell, False) for row in rows for cell in row):
            return [["" for _ in row] for row in rows]
        counts = np.array([[float(cell) for cell in row] for row in rows])
        values = (counts.reshape(-1, 3) - self.zero) @ self.matrix.T
        return [[f"{x:.9g}" for x in row] for row in values.tolist()]


def calibrated_sensor(fields: Mapping[str, str]) -> str:
    """Sensor of a message, accel or gyro; "" of another."""
    return SENSORS.get(fields.get("sensor_type", ""), "")
