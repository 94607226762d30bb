"""A misfit that is too small to matter for navigation.

Chi-squared of a quiet device is significant already if its windows scatter by an r that
nobody would notice. The uncertainties of the estimate include r. With s the uncertainty
of a bias that the grade allows,

    sqrt(s^2 + r^2) < 1.005 s   if   r <= s / 10                                   (1)

so such a scatter does not matter. This is true of scatter only: if a single window may
be wrong, chi-squared decides.
"""

from __future__ import annotations

from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.model import thresholds

SHARE = 0.1
"""Largest r over s, (1)."""


def harmless(found: Calibration, limits: GradeLimits) -> str:
    """Why a misfit does not matter, as part of a sentence; empty if it may matter."""
    scatter = found.info.get("extra_scatter")
    doubt = max(found.info.get("bad_position", ()), default=0.0)
    most = SHARE * limits.acc_bias_sigma
    if scatter is None or not 0 < scatter <= most or doubt >= thresholds.SUSPECT:
        return ""
    return (
        f"that is a scatter of {scatter:.2g} m/s², which the uncertainties include;"
        f" below {most:.2g} m/s² it does not matter for navigation"
    )
