"""Parameters as text: titles, digits, units."""

from __future__ import annotations

import math
from collections.abc import Iterable

from fieldcal.calibration.names import ParameterName

TITLES = {
    "acc_bias": "acc bias",
    "acc_scale": "acc scale factor",
    "gyr_bias": "gyro bias",
    "gyr_scale": "gyro scale factor",
    "cross_coupling": "acc cross-coupling",
    "gyro_cross_coupling": "gyro cross-coupling",
    "angle_offset": "joints' offset",
    "base_tilt": "base tilt",
}
"""Name of each group of parameters."""

UNCHECKED = (
    "not contradicted, and not confirmed: nothing is left to check these numbers"
)
"""Verdict about an estimate with as many parameters as means."""


def format_with_sigma(value: float, sigma: float) -> tuple[str, str]:
    """Value and sigma, with two significant digits of sigma.

    >>> format_with_sigma(0.12345, 0.00234)
    ('0.1235', '0.0023')
    >>> format_with_sigma(123.4, 56.0)
    ('123', '56')
    >>> format_with_sigma(-1e-5, 0.0014)
    ('0.0000', '0.0014')
    """
    if not math.isfinite(sigma) or sigma <= 0:
        return f"{value:z.6g}", "?"
    digits = max(0, 1 - math.floor(math.log10(sigma)))
    return f"{value:z.{digits}f}", f"{sigma:.{digits}f}"


def parameter_title(name: str) -> str:
    """Name of a parameter with its component.

    >>> parameter_title("acc_bias.x"), parameter_title("base_tilt.about_x_deg")
    ('acc bias x', 'base tilt about x')
    """
    parameter = ParameterName.of(name)
    group = parameter.group
    label = parameter.component.replace("_deg", "").replace("_", " ")
    return f"{TITLES.get(group, group.replace('_', ' '))} {label}".strip()


def format_unit(unit: str) -> str:
    """A unit with superscripts; empty for a plain number.

    >>> format_unit("m/s^2*sqrt(Hz)"), format_unit("1/(m/s^2)^2"), format_unit("1")
    ('m/s²·√Hz', '1/(m/s²)²', '')
    """
    raised = unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴")
    for plain, shown in (("sqrt(s)", "√s"), ("sqrt(Hz)", "√Hz"), ("degC", "°C")):
        raised = raised.replace(plain, shown)
    return "" if raised == "1" else raised.replace("*", "·")


def position_numbers(indices: Iterable[int]) -> str:
    """Numbers of positions, from 1; consecutive ones are written as a range.

    >>> position_numbers((0, 1, 2, 5, 7, 8))
    '1–3, 6, 8–9'
    """
    parts: list[list[int]] = []
    for n in sorted(index + 1 for index in indices):
        if parts and n == parts[-1][1] + 1:
            parts[-1][1] = n
        else:
            parts.append([n, n])
    return ", ".join(f"{a}–{b}" if b > a else f"{a}" for a, b in parts)
