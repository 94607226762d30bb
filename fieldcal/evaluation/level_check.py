"""Whether the recording contradicts how level the base is stated to be.

A stated level of standard uncertainty s is a prior of the tilt. A larger tilt is then
taken for biases, and the fit is as good as before. The same rows without the statement
give the tilt t with covariance C, and

    chi2 = t^T (C + s^2 I)^-1 t                                                   (1)

has as many degrees of freedom as t has axes, if the statement is true.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.names import TILTS, group_of
from fieldcal.solve import Observations, solve
from fieldcal.solve.estimation import RecordedRows


def with_tilt_shown(
    calibration: Calibration,
    observations: Observations,
    recorded: RecordedRows | None,
    options: Mapping[str, Any],
) -> Calibration:
    """Add the tilt that the positions show without the stated level to `info`.

    Parameters
    ----------
    calibration : the result with the stated level
    observations, recorded, options : arguments of `solve` that it was made from

    """
    level = calibration.info.get("level_sigma_deg")
    if level is None or calibration.method in ("two_position", "scalar"):
        return calibration
    free = solve(
        observations, recorded=recorded, **{**options, "level_sigma_deg": None}
    )
    at = [i for i, name in enumerate(free.names) if group_of(name) in TILTS]
    if not at:
        return calibration
    tilt = free.values[at]
    covariance = free.covariance[np.ix_(at, at)] + level**2 * np.eye(len(at))
    chi2 = float(tilt @ np.linalg.solve(covariance, tilt))  # (1)
    shown = {"chi2": chi2, "dof": len(at), "tilt_deg": float(np.linalg.norm(tilt))}
    return replace(calibration, info={**calibration.info, "tilt_shown": shown})
