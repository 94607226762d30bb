"""Units and counts that the temperatures of a file may be in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fieldcal.core.samples import Array


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
    return found


USUAL = (5.0, 60.0)
"""Temperatures of a sensor at work, deg C: of counts, other ones may be anything."""


def is_usual_temperature(celsius: float) -> bool:
    """Whether a temperature is that of a sensor at work.

    >>> is_usual_temperature(25.3), is_usual_temperature(-24.9)
    (True, False)
    """
    return USUAL[0] <= celsius <= USUAL[1]


_THERMOMETERS = ((256.0, 25.0), (340.0, 36.53), (333.87, 21.0))
"""Counts in 1 K, and deg C at count 0, of the usual sensors."""


ANALOG_THERMOMETERS = ((10.0, 0.0), (1 / 0.00565, 25.0), (1 / 0.07386, 31.0),
                       (1 / 0.14, 25.0))  # fmt: skip
"""Likewise of the sensors of Analog Devices: ADIS1647x and 1650x, 1648x and 1649x,
16448, and 1640x."""


def temperature_counts(
    low: float,
    high: float,
    thermometers: Sequence[tuple[float, float]] = _THERMOMETERS,
) -> list[str]:
    """Options that make deg C of counts from `low` to `high`, as the usual sensors do.

    >>> temperature_counts(65236, 65240)[0]
    '--temp-unit count --temp-lsb 256 --temp-zero -231 (23.8 to 23.8 deg C)'
    """
    wrapped = 2**16 if low >= 2**15 else 0
    found = []
    for lsb, zero in thermometers:
        coldest, warmest = (zero + (n - wrapped) / lsb for n in (low, high))
        if -45 <= coldest and warmest <= 105:
            found.append(
                f"--temp-unit count --temp-lsb {lsb:.6g} --temp-zero"
                f" {zero - wrapped / lsb:.6g} ({coldest:.1f} to {warmest:.1f} deg C)"
            )
    return found or [
        "--temp-unit count --temp-lsb 256 --temp-zero 25 (counts in 1 K, deg C at count"
        " 0, as its data sheet says)"
    ]
