"""Units and full scales that the numbers of a file may be in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array

MIN_ROWS_ALONE = 8
"""Rows whose length tells a unit, if nothing else."""

MIN_ROWS = 50
"""Rows that tell anything."""

ACC_OUT = (0.06, 0.15)
"""Logarithm of what factory scales are out by: offset known, and not."""

GYR_OUT = (0.05, 0.25)
"""Likewise of rates, where an offset tilts the gravity that is seen to turn."""


class Scale(NamedTuple):
    """A way to read numbers as a quantity.

    Attributes
    ----------
    size : what the quantity reads in it: |a| at rest, or 1 rad/s
    unit, lsb : as the user would give it

    """

    size: float
    unit: str
    lsb: float = 1.0

    def __str__(self) -> str:
        """Say it: "g" or "counts of 16384 in one g"."""
        if self.lsb == 1:
            return self.unit
        if self.lsb < 1:
            return f"gains over {self.lsb:.6g} s, {self.unit} times s"
        return f"counts, {self.lsb:.6g} in a {self.unit}"


def _counts_per_unit(per_unit: float, bits: int = 16) -> float:
    """Counts of so many bits in a unit, by the full scale."""
    return 2.0 ** (bits - 1) / per_unit


CENTI = "cm/s^2"
"""Unit in which a few sensors count; gravity is 2 % less in it than in mg."""

ANALOG = ((800.0, 10.0), (800.0 * 2**16, 10.0 * 2**16))
"""Counts in a g, and in a deg/s beside them, of sensors of Analog Devices in 16 and 32
bits."""

_G_COUNTS = (
    *(_counts_per_unit(full) for full in (2, 3, 4, 6, 8, 12, 16, 24, 32)),
    *(512.0, 256.0, 128.0, 64.0),
    _counts_per_unit(16, 20),
    *(acc for acc, _ in ANALOG),
)
"""Full scales in 16 bits, of 10 to 13 bits, of high resolution in 20 bits, and of the
sensors of Analog Devices in 16 and 32 bits. Not 65536: about so reads the length of
three words of 16 bits whose zero lies in the middle."""

_DEG_COUNTS = (
    *(_counts_per_unit(full) for full in (125, 250, 500, 1000, 2000)),
    *(1 / milli for milli in (8.75e-3, 17.5e-3, 35e-3, 70e-3)),
    _counts_per_unit(1000, 20),
    *(gyr for _, gyr in ANALOG),
)
"""Full scales in 16 bits, ST's sensitivities, and others as of accelerations."""


def counts_beside(size: float) -> tuple[Scale, ...]:
    """Scales of rates in counts that usually stand beside so many counts in a g.

    >>> [scale.lsb for scale in counts_beside(803.0)][:2], counts_beside(16384.0)[0].lsb
    ([10.0, 131.072], 131.072)
    """
    own = [Scale(gyr * 180 / np.pi, "deg/s", gyr) for acc, gyr in ANALOG
           if abs(np.log(size / acc)) < ACC_OUT[0]]  # fmt: skip
    return (*own, *USUAL_COUNTS)


USUAL_COUNTS = tuple(
    Scale(_counts_per_unit(full) * 180 / np.pi, "deg/s", _counts_per_unit(full))
    for full in (250, 500, 1000, 2000)
)
"""Counts of rates as most sensors have them, of the full scale that they begin with."""

ACC_SCALES = (
    Scale(G0, "m/s^2"),
    Scale(1.0, "g"),
    Scale(1000.0, "mg"),
    *(Scale(c, "g", c) for c in _G_COUNTS),
    Scale(1e6, "ug"),
    Scale(1000 * G0, "mm/s^2"),
    Scale(100 * G0, CENTI),
)

GYR_SCALES = (
    Scale(1.0, "rad/s"),
    Scale(180 / np.pi, "deg/s"),
    Scale(1000.0, "mrad/s"),
    *(Scale(c * 180 / np.pi, "deg/s", c) for c in _DEG_COUNTS),
    Scale(180e3 / np.pi, "mdeg/s"),
    Scale(180e6 / np.pi, "udeg/s"),
    Scale(180 * 3600 / np.pi, "deg/h"),
)


BESIDE_CENTI = Scale(16 * 180 / np.pi, "deg/s", 16.0)
"""Counts of rates beside forces in cm/s^2, as the BNO055 by Bosch gives both (its data
sheet, register UNIT_SEL): 2 % less than those of a full scale of 2000 deg/s."""


BESIDE_ADXL345 = (256.0, Scale(14.375 * 180 / np.pi, "deg/s", 14.375))
"""Counts in a g of the ADXL345 by Analog Devices, and in a deg/s of the ITG-3200 by
InvenSense, which boards have beside it: 0.6 % off ST's 70 mdeg/s, which others have."""


def rate_scales(acc_unit: str, acc_lsb: float = 1.0) -> tuple[Scale, ...]:
    """Units and counts that rates may be in beside forces in a unit, or counts of it.

    >>> [s.lsb for s in rate_scales(CENTI) if 16 <= s.lsb < 17]
    [16.0]
    >>> [round(s.lsb, 3) for s in rate_scales("g", 256) if 14 <= s.lsb < 15]
    [14.286, 14.375]
    """
    if acc_lsb == BESIDE_ADXL345[0]:
        return (*GYR_SCALES, BESIDE_ADXL345[1])
    if acc_unit != CENTI:
        return GYR_SCALES
    near = np.log(GYR_OUT[0] + 1)
    others = (s for s in GYR_SCALES if abs(np.log(s.lsb / BESIDE_CENTI.lsb)) > near)
    return (*others, BESIDE_CENTI)


def gain_scales(step: float, unit: str, size: float = 1.0) -> tuple[Scale, ...]:
    """Scales of increments over a step, such as those of velocity.

    Parameters
    ----------
    step : time over which it is gained, s
    unit : of the quantity
    size : what the quantity reads in that unit

    """
    return (Scale(size * step, unit, step),)


def half_angle_scales(step: float) -> tuple[Scale, ...]:
    """Scales of half the angle over a step, s: x y z of the quaternion of the turn.

    They are its sine, which lacks a 24th of the square of the angle: 0.05 % of 6 deg.
    """
    return gain_scales(step / 2, "rad/s")


FULL_SCALES = range(10, 17)
"""Exponents of two of the counts in one g that 16 bits over 1 to 32 g make."""

DIFFERENT = 8
"""Different numbers that are whole counts of a power of two by no chance."""


RATE_SCALES = range(4, 9)
"""The same of the counts in one deg/s that some gyroscopes have."""


def binary_counts(numbers: Array, exponents: range = FULL_SCALES) -> int:
    """Counts in one of the unit of numbers (n, 3), if a power of two; else 0.

    A program that divides the registers by the counts in one g, which are a power of
    two, writes such numbers; those in m/s^2 or of decimals are none.

    >>> counts = np.arange(3000, 3300).reshape(-1, 3)
    >>> [binary_counts(counts / n) for n in (4096, 4096 / 9.80665, 4000)]
    [4096, 0, 0]
    """
    shown = np.unique(numbers[np.isfinite(numbers)])
    if len(shown) < DIFFERENT:
        return 0
    for exponent in exponents:
        counts = shown * 2**exponent
        if np.abs(counts - np.round(counts)).max() < 1e-6:
            return 0 if exponent == exponents[0] else 2**exponent
    return 0


def rounded_text(number: float, digits: int = 3) -> str:
    """A number rounded to few digits, without an exponent.

    >>> rounded_text(32731.0), rounded_text(0.01849), rounded_text(1224.6)
    ('32700', '0.0185', '1220')
    """
    rounded = float(f"{number:.{digits}g}")
    return f"{rounded:.12g}"


def fitting_scales(
    size: float, scales: tuple[Scale, ...], within: float
) -> list[Scale]:
    """Scales in which a quantity reads `size`, within a factor, nearest first.

    Parameters
    ----------
    size, scales : what it shows as, and what it might
    within : logarithm of the factor

    """
    away = {s: abs(float(np.log(size / s.size))) for s in scales}
    fits = sorted((s for s in scales if away[s] <= within), key=away.__getitem__)
    # what reads as mg is mg: only what is nearer to the other unit may be either
    return [s for s in fits if s.unit != CENTI or s is fits[0]]
