"""Compares a calibration with earlier ones of the same device.

The history does not influence the calibration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fieldcal.acceptance.check import Check, unit_suffix
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import ParameterName, group_of
from fieldcal.history.family import FamilySpread, next_run_distribution


def check_change(
    calibration: Calibration,
    limits: GradeLimits,
    family: Sequence[Calibration] | None,
    warmth: Mapping[str, float],
    serial: str = "",
) -> list[Check]:
    """Compare each group with earlier calibrations, by its most unusual parameter.

    Parameters
    ----------
    calibration : the calibration
    limits : limits of its grade
    family : earlier calibrations at its temperature; None without a history
    warmth : additional uncertainty for the change of temperature since, 1 sigma, by
        full name
    serial : of the device; empty if it is not stated

    """
    if family is None:
        why = "the history was not read" if serial else "no serial number (--serial)"
        says = f"no comparison with earlier calibrations: {why}"
        return [Check("change", None, says)]
    if not family:
        says = "no comparison: this is the first calibration of this device"
        return [Check("change", None, says)]
    known = [n for n in calibration.names if limits.repeat(group_of(n)) is not None]
    checks = []
    for group in dict.fromkeys(group_of(n) for n in known):
        names = [n for n in known if group_of(n) == group]
        made = [
            _compared(calibration, n, limits, family, len(known), warmth.get(n, 0.0))
            for n in names
        ]
        checks += sorted(filter(None, made), key=lambda c: c.value or 0.0)[:1]
    return checks


def _compared(
    calibration: Calibration,
    name: str,
    limits: GradeLimits,
    family: Sequence[Calibration],
    together: int,
    warmth: float,
) -> Check | None:
    """One parameter against earlier runs; all parameters share the probability."""
    parameter = ParameterName.of(name)
    usual = usual_values(name, limits, family)
    if usual is None:
        return None
    value = calibration.value(name)
    sigma = float(np.hypot(calibration.uncertainty(name), warmth))
    chance, limit = usual.chance(value, sigma), limits.family_chance / together
    ok = chance >= limit
    unit = unit_suffix(calibration.units[calibration.names.index(name)])
    says = (
        f"{parameter.group} {parameter.component} differs from {usual.runs} earlier"
        f" calibration{'s' if usual.runs > 1 else ''}"
        f"{' at other temperatures' if warmth else ''} by {value - usual.mean:+.2g}"
        f" ± {usual.sigma(sigma):.2g}{unit}"
        f"{'' if ok else ': out of family; inspect the device before you use it'}"
    )
    return Check(f"{parameter.group} change", ok, says, chance, limit, "1")


def usual_values(
    name: str, limits: GradeLimits, family: Sequence[Calibration]
) -> FamilySpread | None:
    """What earlier calibrations let expect of a parameter in the next one.

    None without an earlier one that has it, or if the grade has no limit for it.
    """
    earlier = [c for c in family if name in c.names]
    repeat = limits.repeat(group_of(name))
    if not earlier or repeat is None:
        return None
    return next_run_distribution(
        np.array([c.value(name) for c in earlier]),
        np.array([c.uncertainty(name) for c in earlier]),
        repeat,
    )
