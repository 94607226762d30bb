"""Answers to a question about a unit: options to paste behind the command."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.units.gravity_size import GravityReading
from fieldcal.importing.units.scales import (
    GYR_SCALES,
    USUAL_COUNTS,
    Scale,
    rounded_text,
)


def unit_options(kind: str, fits: list[Scale], unit: str, lsb: float) -> list[str]:
    """Options for the user to paste: units that fit, else counts of about `lsb`."""
    lines = [
        f"--{kind}-unit {s.unit}" + (f" --{kind}-lsb {s.lsb:.6g}" if s.lsb != 1 else "")
        for s in fits
    ]
    return lines or [
        f"--{kind}-unit {unit} --{kind}-lsb {rounded_text(lsb)}"
        " (about so many counts in one"
        f" {unit}; its data sheet says the number)",
        f"--{kind}-unit {unit}, if it is so",
    ]


def zero_options(said: ReadOptions, gravity: GravityReading) -> list[str]:
    """Options to paste if rests in one direction do not show the zero of counts."""
    if gravity.round or said.acc_zero:
        return []
    return [
        "--acc-zero X,Y,Z (the file's numbers at no acceleration, where that is not 0;"
        " the data sheet says them, and a recording with rests in all directions shows"
        " them)"
    ]


def rate_options(reads: float, rate: float, gyr: Array) -> list[str]:
    """Sampling rates to paste at which the unit would be usual.

    Parameters
    ----------
    reads : what 1 rad/s reads at the rate that the user says
    rate : that rate, Hz; 0 where the file has times
    gyr : (n, 3) numbers of the file

    """
    scales = USUAL_COUNTS if (gyr == np.round(gyr)).all() else GYR_SCALES[:2]
    rates = [
        f"--rate {rounded_text(rate * reads / s.size)}, which makes it {s}"
        for s in scales
    ]
    return rates if rate else []


def scales_of_decimals(fits: list[Scale], values: Array) -> list[Scale]:
    """Scales without counts, if values are not integers and other scales fit."""
    known = values[np.isfinite(values)]
    plain = [fit for fit in fits if fit.lsb == 1]
    return plain if plain and (known != np.round(known)).any() else fits


def ask_unit(name: str, what: str, answers: Sequence[str]) -> NoReturn:
    """Ask about a unit of a recording, with answers to paste.

    Raises
    ------
    InputError
        Always.

    """
    raise InputError(f"{name}: {what}: add {' or '.join(answers)}")
