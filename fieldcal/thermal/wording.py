"""Sentences about the change of parameters between two temperatures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fieldcal.calibration.gauge import GROUPS
from fieldcal.calibration.names import group_of
from fieldcal.calibration.wording import format_unit, format_with_sigma, parameter_title
from fieldcal.core.gravity import G0

REPORTED_SIGMAS = 3.0
"""Least change that is reported, in standard uncertainties. Of the twenty parameters of
a device, one would exceed 2 by chance."""


def change_sentences(
    changes: Mapping[str, tuple[float, float]],
) -> tuple[list[str], list[str]]:
    """Sentences about significant changes, and names of the other parameters.

    Parameters
    ----------
    changes : difference and its uncertainty by the full name of the parameter

    """
    told = [
        f"{parameter_title(name)}"
        f" {_format_change(change, sigma, GROUPS[group_of(name)][2])}"
        f"{_consequence(group_of(name), change)}"
        for name, (change, sigma) in changes.items()
        if abs(change) >= REPORTED_SIGMAS * sigma
    ]
    rest = [name for name, (c, s) in changes.items() if abs(c) < REPORTED_SIGMAS * s]
    return told, rest


def change_document(changes: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Changes as an object: value, sigma and unit by name."""
    return {
        name: {"change": change, "sigma": sigma, "unit": GROUPS[group_of(name)][2]}
        for name, (change, sigma) in changes.items()
    }


def _format_change(change: float, sigma: float, unit: str) -> str:
    value, around = format_with_sigma(change, sigma)
    sign = "" if value.startswith("-") else "+"
    return f"{sign}{value} ± {around} {format_unit(unit)}".rstrip()


def _consequence(group: str, change: float) -> str:
    """Error that the change causes if the old value is used."""
    size = abs(change)
    if group == "acc_bias":
        return f", a level wrong by {np.rad2deg(size / G0):.2g}°"
    if group == "gyr_bias":
        return f", {np.rad2deg(size) * 60:.2g}° in a minute"
    if group in ("acc_scale", "cross_coupling"):
        return f", {size * G0:.2g} m/s² at 1 g"
    return f", {size * 360:.2g}° in a full turn"
