"""Estimators: from window averages to parameters with their covariance.

>>> from fieldcal.core.positions import FIVE_POSITIONS
>>> from fieldcal.solve import Observations, solve
"""

from fieldcal.solve.choose import solve
from fieldcal.solve.observations import Observations

__all__ = ["Observations", "solve"]
