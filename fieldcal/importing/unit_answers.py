"""Answers to a question about a unit: options to paste behind the command."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.scales import GYR_SCALES, Scale


def answers(kind: str, fits: list[Scale], unit: str, lsb: float) -> list[str]:
    """Options to paste: those that fit; else counts, about `lsb` in a unit."""
    lines = [
        f"--{kind}-unit {s.unit}" + (f" --{kind}-lsb {s.lsb:.6g}" if s.lsb != 1 else "")
        for s in fits
    ]
    return lines or [
        f"--{kind}-unit {unit} --{kind}-lsb {lsb:.3g} (about so many counts in one"
        f" {unit}; its data sheet says the number)",
        f"--{kind}-unit {unit}, if it is so",
    ]


def as_written(fits: list[Scale], values: Array) -> list[Scale]:
    """Scales without counts, where values are no whole numbers and others do."""
    known = values[np.isfinite(values)]
    plain = [fit for fit in fits if fit.lsb == 1]
    return plain if plain and (known != np.round(known)).any() else fits


def unusual(gyr: Array) -> list[str]:
    """Options for rates of which no turn tells: counts, if they are whole numbers."""
    if (gyr == np.round(gyr)).all():
        counts = [s for s in GYR_SCALES if s.lsb != 1][1:5]
        return answers("gyr", counts, "deg/s", 16.4)
    return ["--gyr-unit deg/s", "--gyr-unit rad/s, if it is so"]
