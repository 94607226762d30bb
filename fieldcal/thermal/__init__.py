"""Combines calibrations at several temperatures into a model over temperature.

`points` makes a calibration independent of what an autopilot had installed, `curves`
are polynomials over temperature, `fit` and `group_fit` fit them, and `wording` states
the change between two temperatures. Effects of temperature within one recording are in
the catalogue, and parameters of autopilots are written in `install`.
"""

from __future__ import annotations

from fieldcal.thermal.curves import ThermalCurve, ThermalModel
from fieldcal.thermal.fit import thermal_model
from fieldcal.thermal.points import ThermalPoint, thermal_point

__all__ = [
    "ThermalCurve",
    "ThermalModel",
    "ThermalPoint",
    "thermal_point",
    "thermal_model",
]
