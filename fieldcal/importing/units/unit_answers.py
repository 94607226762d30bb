"""Answers to a question about a unit: options to paste behind the command."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.recording import ReadOptions
from fieldcal.importing.units.gravity_size import Gravity
from fieldcal.importing.units.scales import GYR_SCALES, USUAL_COUNTS, Scale, about


def answers(kind: str, fits: list[Scale], unit: str, lsb: float) -> list[str]:
    """Options to paste: those that fit; else counts, about `lsb` in a unit."""
    lines = [
        f"--{kind}-unit {s.unit}" + (f" --{kind}-lsb {s.lsb:.6g}" if s.lsb != 1 else "")
        for s in fits
    ]
    return lines or [
        f"--{kind}-unit {unit} --{kind}-lsb {about(lsb)} (about so many counts in one"
        f" {unit}; its data sheet says the number)",
        f"--{kind}-unit {unit}, if it is so",
    ]


def zero_elsewhere(said: ReadOptions, gravity: Gravity) -> list[str]:
    """What to paste where rests in one direction cannot show the zero of counts."""
    if gravity.round or said.acc_zero:
        return []
    return [
        "--acc-zero X,Y,Z (the file's numbers at no acceleration, where that is not 0;"
        " the data sheet says them, and a recording with rests in all directions shows"
        " them)"
    ]


def other_rates(reads: float, rate: float, gyr: Array) -> list[str]:
    """Rates to paste at which the unit would be a usual one.

    Parameters
    ----------
    reads : what 1 rad/s reads at the rate that the user says
    rate : that rate, Hz; 0 where the file has times
    gyr : (n, 3) numbers of the file

    """
    scales = USUAL_COUNTS if (gyr == np.round(gyr)).all() else GYR_SCALES[:2]
    rates = [
        f"--rate {about(rate * reads / s.size)}, which makes it {s}" for s in scales
    ]
    return rates if rate else []


def as_written(fits: list[Scale], values: Array) -> list[Scale]:
    """Scales without counts, where values are no whole numbers and others do."""
    known = values[np.isfinite(values)]
    plain = [fit for fit in fits if fit.lsb == 1]
    return plain if plain and (known != np.round(known)).any() else fits
