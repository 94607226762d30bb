"""What a change of temperature costs, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fieldcal.calibration.gauge import GROUPS
from fieldcal.calibration.names import group_of
from fieldcal.calibration.wording import format_unit, format_with_sigma, parameter_title
from fieldcal.core.gravity import G0

TOLD = 3.0
"""A change is told from so many of its standard uncertainties on: a device has twenty
parameters, of which one would reach 2 by chance."""


def costs(
    changes: Mapping[str, tuple[float, float]],
) -> tuple[list[str], list[str]]:
    """Sentences on parameters that change, and names of those that do not show it.

    Parameters
    ----------
    changes : difference and its uncertainty by the full name of the parameter

    """
    told = [
        f"{parameter_title(name)} {_signed(change, sigma, GROUPS[group_of(name)][2])}"
        f"{_means(group_of(name), change)}"
        for name, (change, sigma) in changes.items()
        if abs(change) >= TOLD * sigma
    ]
    rest = [name for name, (c, s) in changes.items() if abs(c) < TOLD * s]
    return told, rest


def document(changes: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Changes as an object: value, sigma and unit by name."""
    return {
        name: {"change": change, "sigma": sigma, "unit": GROUPS[group_of(name)][2]}
        for name, (change, sigma) in changes.items()
    }


def _signed(change: float, sigma: float, unit: str) -> str:
    value, around = format_with_sigma(change, sigma)
    sign = "" if value.startswith("-") else "+"
    return f"{sign}{value} ± {around} {format_unit(unit)}".rstrip()


def _means(group: str, change: float) -> str:
    """What the change does to who uses the old value."""
    size = abs(change)
    if group == "acc_bias":
        return f", a level wrong by {np.rad2deg(size / G0):.2g}°"
    if group == "gyr_bias":
        return f", {np.rad2deg(size) * 60:.2g}° in a minute"
    if group in ("acc_scale", "cross_coupling"):
        return f", {size * G0:.2g} m/s² at 1 g"
    return f", {size * 360:.2g}° in a full turn"
