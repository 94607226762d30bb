"""Uncertainty of set angles as a recording shows it.

The diagnosis finds the scatter of the set angles. Offsets of the accelerometers that
differ from position to position without a known cause may be errors of angles too; the
equivalent angle is

    sigma = max_c sqrt(mean_p o_pc^2) / g                                          (1)

with the offset o_pc, m/s^2, of accelerometer c in position p, and sigma in rad. The
accelerometers cannot distinguish offsets from errors of angles; in the turns between
positions only errors of angles show.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.samples import ACC
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.random_sizes import random_sizes
from fieldcal.diagnosis.wording.paragraph import setup_notes
from fieldcal.effects import catalogue
from fieldcal.evaluation.omitted_effects import wrong_angle_sentences
from fieldcal.model import thresholds
from fieldcal.physics.effect import Scatter

OTHER_ANGLES = (
    "the positions are not those of session.toml: most of them lie elsewhere than its"
    " angles say, by more than anybody sets an angle wrong; look for positions in"
    " another order, a sign, or axes that are named wrongly, and solve again"
)
"""Warning if most angles are wrong."""

BY_POSITION = ("window", "position", "alpha", "beta", "joints", "force")
"""Functions without physics that depend on the position of the device."""


def shown_angle_setting(explanation: Explanation) -> float:
    """Scatter of set angles found in a recording, deg; 0 if none is found."""
    found = [0.0]
    for cause in explanation.probable_causes:
        effect = catalogue().get(cause.name)
        if isinstance(effect, Scatter) and {p.unit for p in effect.params} == {"deg"}:
            sizes = random_sizes(explanation, cause).values()
            found += [q.value for q in sizes if isinstance(q.value, float)]
    return max(found)


def angle_equivalent_of_offsets(explanation: Explanation) -> float:
    """Angle with the effect of offsets of unknown cause, (1), deg; 0 without any."""
    x, d = explanation.rows.x, explanation.dictionary
    unknown = [
        group.columns
        for cause in explanation.probable_causes
        if cause.kind == "unknown" and cause.name in BY_POSITION
        for _, group in cause.members
    ]
    if not unknown or not x.oriented.any():
        return 0.0
    fitted = replace(explanation.best, set=explanation.posterior.best)
    estimate, without_unknown = fitted.estimate, fitted.estimate
    without_unknown[np.concatenate(unknown)] = 0.0
    offset = fitted.residual(without_unknown) - fitted.residual(estimate)
    offset = offset[:, ACC] / d.unit[ACC]
    held = np.unique(x.position[x.oriented])
    mean = np.array([np.nan_to_num(offset[x.position == p]).mean(axis=0) for p in held])
    size = np.sqrt((mean**2).mean(axis=0)).max() / x.gravity  # (1)
    return float(np.rad2deg(size))


def with_shown_angle_setting(
    fit: Callable[[], Calibration], options: dict[str, Any], shown: Explanation | None
) -> tuple[Calibration, list[str]]:
    """Fit with the stated uncertainty of angles, or the larger one that is shown.

    Returns the result and sentences for the user. The larger uncertainty is used only
    if it has more evidence, because the requested parameters, such as a tilt of the
    base, may explain the scatter as well.

    Parameters
    ----------
    fit : solves with the present values in `options`
    options : arguments of `solve`; the uncertainty of angles is changed in place
    shown : explanation of the recording; None if it was not examined

    """
    found = fit()
    if shown is None:
        return found, []
    notes = [*wrong_angle_sentences(shown), *setup_notes(shown)]
    stated, angles = float(options["angle_sigma_deg"]), shown_angle_setting(shown)
    if angles > stated:
        options["angle_sigma_deg"] = min(angles, thresholds.MEANINGLESS_ANGLE_DEG)
        wider = fit()
        if wider.info["log_evidence"] <= found.info["log_evidence"]:
            options["angle_sigma_deg"] = stated
        elif angles <= thresholds.MEANINGLESS_ANGLE_DEG:
            found, notes = wider, [_worse_set(angles, stated), *notes]
        else:
            options["angle_sigma_deg"] = stated
            warnings = (OTHER_ANGLES, *found.warnings)
            return replace(found, warnings=warnings, good=False), notes
    if (unknown := angle_equivalent_of_offsets(shown)) > options["angle_sigma_deg"]:
        options["angle_sigma_deg"] = min(unknown, thresholds.MEANINGLESS_ANGLE_DEG)
        found, notes = fit(), [_may_be_angles(unknown), *notes]
    return found, notes


def _may_be_angles(angles: float) -> str:
    return (
        "accelerometers are off in some positions for no reason that is known, by as"
        f" much as angles set to ± {angles:.2g}° would make them: the uncertainties are"
        " for that; fieldcal diagnose says where"
    )


def _worse_set(angles: float, stated: float) -> str:
    return (
        f"the recording shows that angles are set to ± {angles:.2g}° only, not"
        f" ± {stated:.2g}°: the uncertainties are for that; mend the fixture, or write"
        " down the angles that it really sets"
    )
