"""Units and counts that the temperatures of a file may be in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array

USUAL = (5.0, 60.0)
"""Temperatures of a sensor at work, deg C: of counts, other ones may be anything."""

WHOLE = {"ddegC": 10.0, "mdegC": 1000.0}
"""Parts of a degree that only whole numbers count, and how many are in one."""


def temperature_fits(values: Array) -> Mapping[str, float]:
    """Readings of temperatures (n,), with the median of each in deg C."""
    values = values[np.isfinite(values)]
    if not len(values):
        return {"degC": np.nan}
    low, middle, high = (float(f(values)) for f in (np.min, np.median, np.max))
    if -60 <= low and high <= 150:
        return {"degC": middle}
    found = {}
    if -6000 <= low and high <= 15000 and abs(middle) > 1000:
        found["cdegC"] = middle / 100
    if 213 <= low and high <= 423:
        found["K"] = middle - 273.15
    whole = bool((values == np.round(values)).all())
    for unit, many in WHOLE.items():
        if whole and USUAL[0] * many <= low and high <= USUAL[1] * many:
            found[unit] = middle / many
    return found


def is_usual_temperature(celsius: float) -> bool:
    """Whether a temperature is that of a sensor at work.

    >>> is_usual_temperature(25.3), is_usual_temperature(-24.9)
    (True, False)
    """
    return USUAL[0] <= celsius <= USUAL[1]


def may_be_fahrenheit(low: float, high: float) -> bool:
    """Whether temperatures, hot for deg C, are those of a room in deg F.

    >>> may_be_fahrenheit(68.4, 77.0), may_be_fahrenheit(25.0, 70.0)
    (True, False)
    """
    return USUAL[1] < low and is_usual_temperature((high - 32) * 5 / 9)


class ThermometerScale(NamedTuple):
    """Counts of a sensor's thermometer.

    Attributes
    ----------
    lsb : counts in 1 K
    zero : deg C at count 0
    chips : that count so

    """

    lsb: float
    zero: float
    chips: str


THERMOMETERS = (
    ThermometerScale(256.0, 25.0, "LSM6DSL, LSM6DSO, ISM330"),
    ThermometerScale(340.0, 36.53, "MPU-6000, MPU-6050"),
    ThermometerScale(333.87, 21.0, "MPU-9250, ICM-20948"),
    ThermometerScale(132.48, 25.0, "ICM-42688"),
    ThermometerScale(512.0, 23.0, "BMI160, BMI270"),
)
"""Those of the usual sensors, by their data sheets."""

ANALOG_THERMOMETERS = (
    ThermometerScale(10.0, 0.0, "ADIS1647x, ADIS1650x"),
    ThermometerScale(1 / 0.00565, 25.0, "ADIS1648x"),
    ThermometerScale(1 / 0.0125, 25.0, "ADIS16495, ADIS16497"),
    ThermometerScale(1 / 0.014285, 25.0, "ADIS16490"),
    ThermometerScale(1 / 0.07386, 31.0, "ADIS16448"),
    ThermometerScale(1 / 0.14, 25.0, "ADIS1640x"),
)
"""Likewise of the sensors of Analog Devices."""


def temperature_counts(
    low: float,
    high: float,
    thermometers: Sequence[ThermometerScale] = THERMOMETERS,
) -> list[str]:
    """Options that make deg C of counts from `low` to `high`, as the usual sensors do.

    >>> temperature_counts(65236, 65240)[0]
    '--temp-unit count --temp-lsb 256 --temp-zero -231 (LSM6DSL, LSM6DSO, ISM330: \
23.8 to 23.8 deg C)'
    """
    wrapped = 2**16 if low >= 2**15 else 0
    found = []
    for lsb, zero, chips in thermometers:
        coldest, warmest = (zero + (n - wrapped) / lsb for n in (low, high))
        if -45 <= coldest and warmest <= 105:
            found.append(
                f"--temp-unit count --temp-lsb {lsb:.6g} --temp-zero"
                f" {zero - wrapped / lsb:.6g} ({chips}: {coldest:.1f} to"
                f" {warmest:.1f} deg C)"
            )
    return found or [
        "--temp-unit count --temp-lsb 256 --temp-zero 25 (counts in 1 K, deg C at count"
        " 0, as its data sheet says)"
    ]
