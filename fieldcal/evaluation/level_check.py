"""Whether the recording contradicts how level the base is stated to be.

A level with the stated standard uncertainty s, deg, is a prior of the base tilt. If the
true tilt is larger, the fit attributes it to biases, and its residuals do not show it.
Therefore the same rows are solved without this prior, which gives the tilt t, deg, with
the covariance C. If the statement is true,

    chi2 = t^T (C + s^2 I)^-1 t                                                   (1)

has a chi-squared distribution with as many degrees of freedom as t has axes.
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
