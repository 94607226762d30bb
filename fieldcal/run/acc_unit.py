"""What the accelerometers' unit may be, if at rest they do not read gravity.

    |a| at rest is g                                                               (1)

tells units and full scales apart that differ by more than a raw device is out.
"""

from __future__ import annotations

from math import inf, isfinite, log
from urllib.parse import parse_qsl

from fieldcal.core.gravity import G0
from fieldcal.importing.units.scales import (
    ACC_SCALES,
    Scale,
    fitting_scales,
    rounded_text,
)
from fieldcal.session.units import ACC_UNITS

NORM = 0.15
"""Relative deviation of the norm from g beyond which unit or scale must be wrong."""

FULL_SCALES_G = (2.0, 4.0, 8.0, 16.0, 32.0)
"""Full scales that accelerometers can be set to, g."""

USUAL_FULL_SCALE_G = 16.0
"""Full scale that `acc_range` has by default, g."""

UNKNOWN = "check unit, range and wire format"
"""What is said where no unit fits."""


def reads_gravity(norm: float, gravity: float) -> bool:
    """Whether a specific force of length `norm` at rest may be gravity, both m/s^2."""
    return abs(norm - gravity) <= NORM * gravity


def acc_unit_message(norm: float, gravity: float, address: str = "") -> str:
    """What accelerometers read in place of gravity, and what to do about it.

    Parameters
    ----------
    norm : length of the specific force at rest by the present unit, m/s^2
    gravity : m/s^2
    address : of the device, with its options; empty if there is none

    """
    return (
        f"the accelerometers read {rounded_text(norm)} m/s² in all, gravity is"
        f" {gravity:.2f} m/s²: {_remedy(norm, gravity, address) or UNKNOWN}"
    )


def _remedy(norm: float, gravity: float, address: str) -> str:
    """The option of the address that would make it gravity; empty without one."""
    place, _, query = address.partition("?")
    told = dict(parse_qsl(query))
    if not (isfinite(norm) and norm > 0):
        return ""
    form = told.get("format", "witmotion" if place.startswith("serial:") else "")
    if form == "witmotion":
        return _range_remedy(norm, gravity, told.get("acc_range", ""))
    if form != "text" and not place.startswith("can:"):
        return ""
    size = _si_value(told.get("acc_unit", "m/s^2" if form == "text" else ""))
    if not isfinite(size):
        return ""
    standard = norm / size * G0 / gravity
    fits = fitting_scales(standard, ACC_SCALES, log(1 + NORM))
    if not fits:
        return ""
    # a raw device is out by more than counts of 1024 in a g are from mg
    own = next((scale for scale in fits if scale.lsb == 1), fits[0])
    kind = own.unit if own.lsb == 1 else f"counts, {own.lsb:.6g} in a g"
    return (
        f"if they are in {kind}: begin again with acc_unit={_written(own)} in the"
        " device's address"
    )


def _range_remedy(norm: float, gravity: float, stated: str) -> str:
    """Remedy for 16-bit words that were read by another full scale than their own."""
    try:
        full = float(stated or USUAL_FULL_SCALE_G) * gravity / norm
    except ValueError:
        return ""
    own = min(FULL_SCALES_G, key=lambda scale: abs(log(scale / full)))
    if abs(log(own / full)) > log(1 + NORM):
        return ""
    return (
        f"if the device is set to ± {own:g} g: begin again with acc_range={own:g} in"
        " its address"
    )


def _written(scale: Scale) -> str:
    """A scale as the option of an address has it.

    >>> _written(Scale(16384.0, "g", 16384.0)), _written(Scale(1.0, "g"))
    ('0.0610352*mg', 'g')
    """
    if scale.lsb != 1:
        return f"{1000 / scale.lsb:.6g}*mg"
    known = scale.unit in ACC_UNITS
    return scale.unit if known else f"{G0 / scale.size:.6g}*m/s^2"


def _si_value(unit: str) -> float:
    """SI value of an option's unit; infinite if it is none or that of a DBC file.

    >>> _si_value("g"), _si_value("0.5*m/s^2")
    (9.80665, 0.5)
    """
    factor, _, name = unit.rpartition("*")
    try:
        return float(factor or 1.0) * ACC_UNITS[name]
    except (ValueError, KeyError):
        return inf
