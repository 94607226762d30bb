"""Calibrations: parameters with their covariance, applied, compared and stored.

The limits that a recalibration must reach are here too (`limits`). Nothing here
estimates: estimators return a `Calibration`.
"""

from fieldcal.calibration.comparison import Comparison, compare
from fieldcal.calibration.gauge import Gauge
from fieldcal.calibration.parameters import (
    COMPONENTS,
    Calibration,
    Method,
    Nominal,
)

__all__ = [
    "COMPONENTS",
    "Calibration",
    "Comparison",
    "Gauge",
    "Method",
    "Nominal",
    "compare",
]
