"""Calibrations at several temperatures as one model: parameters over temperature.

Here live what a calibration says of one temperature (`points`), the polynomials that
several of them make (`curves`, fitted in `fit`), and what a change of temperature costs
in words (`wording`). What follows temperature within one recording is an effect of the
catalogue, and parameters of autopilots are written in `install`.
"""

from __future__ import annotations

from fieldcal.thermal.curves import ThermalCurve, ThermalModel
from fieldcal.thermal.fit import thermal_model
from fieldcal.thermal.points import ThermalPoint, point

__all__ = ["ThermalCurve", "ThermalModel", "ThermalPoint", "point", "thermal_model"]
