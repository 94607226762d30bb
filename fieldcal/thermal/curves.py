"""Parameters of a device as polynomials over temperature.

    theta(T) = sum_{n=0}^{3} a_n (T - T_ref)^n                                      (1)
    var theta(T) = t^T V t,   t = (1, T - T_ref, (T - T_ref)^2, (T - T_ref)^3)      (2)
    theta(T) - theta(T') = sum_{n=1}^{3} a_n ((T - T_ref)^n - (T' - T_ref)^n)       (3)

with V the covariance of a. The model holds between the coldest and the warmest session
only, since a polynomial of third order diverges outside of them. Units: the parameter's
per K^n; T deg C.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array

TERMS = 4
"""Terms of (1): autopilots accept polynomials of third order."""

EDGE_K = 0.05
"""Tolerance at both ends of the range, K, since temperatures are shown to 0.1 K."""


@dataclass(frozen=True, slots=True)
class ThermalCurve:
    """One parameter over temperature, (1).

    Attributes
    ----------
    unit : of the parameter
    coefficients : a, (4,)
    covariance : V, (4, 4)
    orders : probability of the orders 0 to 3, (4,), of the parameter's group
    spread : standard deviation from run to run beyond the uncertainties
    held_out : each session's value less the prediction from the others, over its
        standard uncertainty, (n,); nan where there is none

    """

    unit: str
    coefficients: Array
    covariance: Array
    orders: Array
    spread: float
    held_out: Array

    @property
    def order(self) -> int:
        """The most probable order."""
        return int(np.argmax(self.orders))

    def value(self, offset_k: float) -> tuple[float, float]:
        """Value and standard uncertainty at T - T_ref, K, (1), (2)."""
        return self._value_and_sigma(np.power(offset_k, np.arange(TERMS)))

    def change(self, offset_k: float, from_k: float) -> tuple[float, float]:
        """Difference and its uncertainty between two T - T_ref, K, (3)."""
        n = np.arange(TERMS)
        return self._value_and_sigma(np.power(offset_k, n) - np.power(from_k, n))

    def _value_and_sigma(self, t: Array) -> tuple[float, float]:
        return float(t @ self.coefficients), float(np.sqrt(t @ self.covariance @ t))


@dataclass(frozen=True, slots=True)
class ThermalModel:
    """All parameters of a device over temperature.

    Attributes
    ----------
    curves : by the full name of the parameter
    reference : T_ref, deg C
    low, high : of the coldest and the warmest session, deg C
    sessions : name and temperature of each session

    """

    curves: Mapping[str, ThermalCurve]
    reference: float
    low: float
    high: float
    sessions: tuple[tuple[str, float], ...]

    def at(self, temperature: float) -> dict[str, tuple[float, float]]:
        """Values and uncertainties of all parameters at a temperature, deg C.

        Raises
        ------
        InputError
            If the temperature is outside of the range of the sessions.

        """
        offset_k = self._inside(temperature)
        return {name: curve.value(offset_k) for name, curve in self.curves.items()}

    def change(self, to: float, since: float) -> dict[str, tuple[float, float]]:
        """Changes of all parameters between two temperatures, deg C, with their ±.

        Raises
        ------
        InputError
            If a temperature is outside of the range of the sessions.

        """
        warm, cold = self._inside(to), self._inside(since)
        return {name: curve.change(warm, cold) for name, curve in self.curves.items()}

    def of(self, group: str) -> list[ThermalCurve] | None:
        """Curves of the x, y and z of a group; None if one is missing."""
        every = [self.curves.get(f"{group}.{axis}") for axis in "xyz"]
        return None if None in every else [c for c in every if c is not None]

    def to_json(self) -> dict[str, Any]:
        """Return it as an object."""
        return {
            "format": 1,
            "reference_degc": self.reference,
            "range_degc": [self.low, self.high],
            "sessions": [{"name": n, "temperature_degc": t} for n, t in self.sessions],
            "parameters": {
                n: _curve_document(curve) for n, curve in self.curves.items()
            },
        }

    def _inside(self, temperature: float) -> float:
        if not self.low - EDGE_K <= temperature <= self.high + EDGE_K:
            raise InputError(
                f"{temperature:.1f} °C is beyond the sessions, which were taken at"
                f" {self.low:.1f} to {self.high:.1f} °C: record one there"
            )
        return float(np.clip(temperature, self.low, self.high)) - self.reference


def _curve_document(curve: ThermalCurve) -> dict[str, Any]:
    told = [None if not np.isfinite(z) else float(z) for z in curve.held_out]
    return {
        "unit": curve.unit,
        "coefficients": curve.coefficients.tolist(),
        "covariance": curve.covariance.tolist(),
        "orders": curve.orders.tolist(),
        "spread": curve.spread,
        "held_out": told,
    }
