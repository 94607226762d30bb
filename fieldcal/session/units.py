"""Units of samples: SI, or volts and counts, converted by the nominal scale factors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fieldcal.calibration import Gauge
from fieldcal.calibration.gauge import SI
from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array

ACC_UNITS = {"m/s^2": 1.0, "g": G0, "mg": 1e-3 * G0, "V": 1.0, "count": 1.0}
GYR_UNITS = {
    "rad/s": 1.0,
    "deg/s": np.pi / 180,
    "mrad/s": 1e-3,
    "V": 1.0,
    "count": 1.0,
}
"""SI value of each unit; outputs in V or counts are divided by the gauge."""

UNSCALED = ("V", "count")
"""Units that are converted by the nominal scale factors."""

UNITS = {"acceleration": ACC_UNITS, "angular_rate": GYR_UNITS}

NOMINAL_SCALES = ("acc_scale", "gyr_scale")
NOMINAL = {"acc_bias": 0.0, "acc_scale": 1.0, "gyr_bias": 0.0, "gyr_scale": 1.0}


def parse_nominal(table: Mapping[str, Any]) -> dict[str, Array]:
    """Calibration in table [nominal], (3,) each; by default bias 0, scale factor 1."""
    given = {name: table.get(name, [usual] * 3) for name, usual in NOMINAL.items()}
    return {name: np.array(three, float) for name, three in given.items()}


def output_gauge(units: Mapping[str, str], nominal: Mapping[str, Array]) -> Gauge:
    """Volts or counts per SI unit of each triad, from the nominal scale factors.

    Raises
    ------
    InputError
        If a scale factor is 0.

    """
    size, named = [1.0, 1.0], list(SI)
    for i, (kind, scale) in enumerate(zip(UNITS, NOMINAL_SCALES, strict=True)):
        if units[kind] in UNSCALED:
            size[i], named[i] = float(np.abs(nominal[scale]).mean()), units[kind]
    if not all(size):
        raise InputError("[nominal] a scale factor is 0: give one that is not")
    return Gauge((size[0], size[1]), (named[0], named[1]))


def full_scales(
    table: Mapping[str, Any], units: Mapping[str, str], gauge: Gauge
) -> dict[str, float]:
    """Full scale of each quantity in table [range], SI."""
    scale = {k: UNITS[k][units[k]] / c for k, c in zip(UNITS, gauge.size, strict=True)}
    return {k: float(table[k]) * scale[k] for k in UNITS if k in table}
