"""A misfit counts by what it does to the parameters and to the navigator.

A quiet device shows by chi-squared what nobody would notice: windows that scatter by r
beside a noise that is far below. The estimate has r in its uncertainties already, and
beside a bias that the grade allows to be known to s,

    sqrt(s^2 + r^2) < 1.005 s   where   r <= s / 10                                (1)

so it moves nothing that a navigator could tell. That holds of scatter alone: where one
window may be off by itself, chi-squared stands.
"""

from __future__ import annotations

from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.model import thresholds

SHARE = 0.1
"""Of what the grade allows, (1)."""


def harmless(found: Calibration, limits: GradeLimits) -> str:
    """Why a misfit is none for the navigator; empty if it may be one."""
    scatter = found.info.get("extra_scatter")
    doubt = max(found.info.get("bad_position", ()), default=0.0)
    most = SHARE * limits.acc_bias_sigma
    if scatter is None or not 0 < scatter <= most or doubt >= thresholds.SUSPECT:
        return ""
    return (
        f"that is a scatter of {scatter:.2g} m/s², which the uncertainties have in them"
        f" and no navigator notices below {most:.2g} m/s²"
    )
