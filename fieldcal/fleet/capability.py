"""A parameter over the units of a lot: spread, process capability, control charts.

With tolerance +-T about the nominal value, m and t the mean and spread of the units
(`spread`),

    Cp = T / (3 t),   Cpk = (T - |m - nominal|) / (3 t)                             (1)
    var Cp = Cp^2 var t / t^2,   var Cpk = var m / (9 t^2) + Cpk^2 var t / t^2      (2)

If the values of the units have no errors, var Cpk of (2) is 1 / (9 n) + Cpk^2 / (2 (n -
1)), the result of Bissell, Applied Statistics 39 (1990) 331. Errors of the values make
the spread less certain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import ParameterName
from fieldcal.core.samples import Array, Index
from fieldcal.fleet.chart_limits import chart_limits
from fieldcal.fleet.control import ControlChart, cusum, ewma
from fieldcal.fleet.spread import UnitDistribution, estimate_distribution

FALSE_ALARM = 0.05
"""Chance of a false alarm of any control chart over the whole lot."""

CHARTS = 2
"""Number of control charts per parameter."""


@dataclass(frozen=True, slots=True)
class LotParameter:
    """A parameter over the units of a lot.

    Attributes
    ----------
    name, unit : name and unit of the parameter
    unit_numbers : (n,) number of each unit that has the parameter
    x, sigma : (n,) value and standard uncertainty, in the order of time
    distribution : mean and spread over the units
    cp, cp_sigma, cpk, cpk_sigma : (1), (2); None without a tolerance, or if the
        estimated spread is zero
    cpk_at_least : Cpk at the upper end of the 95 % interval of the spread; None without
        a tolerance
    tolerance : T, largest accepted deviation from the nominal value
    untimed : number of the first units, whose time is unknown
    charts : control charts of the other units

    """

    name: str
    unit: str
    unit_numbers: Index
    x: Array
    sigma: Array
    distribution: UnitDistribution
    tolerance: float | None
    cp: float | None
    cp_sigma: float | None
    cpk: float | None
    cpk_sigma: float | None
    cpk_at_least: float | None
    untimed: int
    charts: tuple[ControlChart, ...]

    @property
    def cpk_text(self) -> str:
        """Cpk with its ±, or a lower bound if the spread is within the errors."""
        if self.cpk is not None:
            return f"{self.cpk:.2f} ± {self.cpk_sigma:.2f}"
        least = self.cpk_at_least
        return "" if least is None else f"> {least:.2g} (95 %)"

    def to_json(self) -> dict[str, Any]:
        """Return a JSON object; null where a value is not known."""
        return {
            "unit": self.unit,
            "units": len(self.x),
            "mean": self.distribution.mean,
            "mean_sigma": self.distribution.mean_sigma,
            "spread": self.distribution.spread,
            "spread_95": [self.distribution.low, self.distribution.high],
            "median_sigma": float(np.median(self.sigma)),
            "tolerance": self.tolerance,
            "cp": self.cp,
            "cp_sigma": self.cp_sigma,
            "cpk": self.cpk,
            "cpk_sigma": self.cpk_sigma,
            "cpk_at_least": self.cpk_at_least,
        }


def lot_parameter(
    name: str,
    unit: str,
    units: Index,
    x: Array,
    sigma: Array,
    limits: GradeLimits,
    together: int,
    untimed: int = 0,
) -> LotParameter:
    """Calculate spread, process capability and control charts of one parameter.

    Parameters
    ----------
    name, unit : name and unit of the parameter
    units : (n,) number of each unit
    x, sigma : (n,) value and standard uncertainty, in the order of time
    limits : limits of the grade, which contain the tolerance
    together : number of parameters of the lot; they share `FALSE_ALARM`
    untimed : number of the first units, whose time is unknown; charts exclude them

    """
    about = estimate_distribution(x, sigma)
    parsed = ParameterName.of(name)
    tolerance = limits.tolerance(parsed.group)
    cp = cp_sigma = cpk = cpk_sigma = least = None
    off = abs(about.mean - (1.0 if parsed.is_scale else 0.0))
    if tolerance is not None and about.high > 0:
        least = (tolerance - off) / (3 * about.high)
    if tolerance is not None and about.spread > 0:
        cp = tolerance / (3 * about.spread)  # (1)
        cpk = (tolerance - off) / (3 * about.spread)
        part = about.spread_sigma / about.spread
        cp_sigma = cp * part  # (2)
        cpk_sigma = float(np.hypot(about.mean_sigma / (3 * about.spread), cpk * part))
    z = ((x - about.mean) / about.sigma)[untimed:]
    charts: tuple[ControlChart, ...] = ()
    if len(z):
        chance = FALSE_ALARM / (together * CHARTS)
        bounds = chart_limits(len(x), untimed, chance)
        charts = (ewma(z, bounds[0]), cusum(z, bounds[1]))
    return LotParameter(
        name, unit, units, x, sigma, about, tolerance, cp, cp_sigma, cpk, cpk_sigma,
        least, untimed, charts,
    )  # fmt: skip
