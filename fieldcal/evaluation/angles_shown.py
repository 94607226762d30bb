"""How well a recording shows that angles are set.

It shows it by their scatter, which a diagnosis finds; and what accelerometers are
off by from position to position for no known reason may be an angle too:

    sigma = max_c sqrt(mean_p o_pc^2) / g                                          (1)

with the offset o_pc of output c in position p. The accelerometers cannot tell which of
the two it is, and the turns between the positions are off by an angle alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.samples import ACC
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.found_effects import random_sizes
from fieldcal.diagnosis.wording.paragraph import setup_notes
from fieldcal.effects import catalogue
from fieldcal.evaluation.not_carried import wrong_angles
from fieldcal.model import thresholds
from fieldcal.physics.effect import Scatter

OTHER_ANGLES = (
    "the positions are not those of session.toml: most of them lie elsewhere than its"
    " angles say, by more than anybody sets an angle wrong; look for positions in"
    " another order, a sign, or axes that are named wrongly, and solve again"
)
"""Said where angles say nothing."""

BY_POSITION = ("window", "position", "alpha", "beta", "joints", "force")
"""Functions without physics that go with how the device lies."""


def angles_set(explanation: Explanation) -> float:
    """How well a recording shows that angles are set, deg; 0 if it shows nothing."""
    found = [0.0]
    for one in explanation.probable_causes:
        effect = catalogue().get(one.name)
        if isinstance(effect, Scatter) and {p.unit for p in effect.params} == {"deg"}:
            told = random_sizes(explanation, one).values()
            found += [q.value for q in told if isinstance(q.value, float)]
    return max(found)


def angles_of_offsets(explanation: Explanation) -> float:
    """Angles that offsets without a known cause may be, deg; 0 if there are none."""
    x, d = explanation.rows.x, explanation.dictionary
    unknown = [
        group.columns
        for one in explanation.probable_causes
        if one.kind == "unknown" and one.name in BY_POSITION
        for _, group in one.members
    ]
    if not unknown or not x.oriented.any():
        return 0.0
    fitted = replace(explanation.best, set=explanation.posterior.best)
    whole, less = fitted.estimate, fitted.estimate
    less[np.concatenate(unknown)] = 0.0
    off = (fitted.residual(less) - fitted.residual(whole))[:, ACC] / d.unit[ACC]
    held = np.unique(x.position[x.oriented])
    mean = np.array([np.nan_to_num(off[x.position == p]).mean(axis=0) for p in held])
    size = np.sqrt((mean**2).mean(axis=0)).max() / x.gravity  # (1)
    return float(np.rad2deg(size))


def with_angles_shown(
    fit: Callable[[], Calibration], asked: dict[str, Any], shown: Explanation | None
) -> tuple[Calibration, list[str]]:
    """The result with angles set as stated, or as the recording shows, and sentences.

    The rows are those of the set that is asked for: what this explains with the angles
    as stated, such as a tilt of the base, shows nothing of the angles.

    Parameters
    ----------
    fit : result of what is asked for
    asked : what is; how well angles are set in the end
    shown : by the recording

    """
    found = fit()
    if shown is None:
        return found, []
    notes = [*wrong_angles(shown), *setup_notes(shown)]
    stated, angles = float(asked["angle_sigma_deg"]), angles_set(shown)
    if angles > stated:
        asked["angle_sigma_deg"] = min(angles, thresholds.NO_ANGLE)
        wider = fit()
        if wider.info["log_evidence"] <= found.info["log_evidence"]:
            asked["angle_sigma_deg"] = stated
        elif angles <= thresholds.NO_ANGLE:
            found, notes = wider, [_worse_set(angles, stated), *notes]
        else:
            asked["angle_sigma_deg"] = stated
            warnings = (OTHER_ANGLES, *found.warnings)
            return replace(found, warnings=warnings, good=False), notes
    if (unknown := angles_of_offsets(shown)) > asked["angle_sigma_deg"]:
        asked["angle_sigma_deg"] = min(unknown, thresholds.NO_ANGLE)
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
