"""What limits a diagnosis: parameters, sensors and fits that the rows leave open."""

from __future__ import annotations

import numpy as np

from fieldcal.calibration.names import group_of
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings import found_effects
from fieldcal.diagnosis.findings.calibrated import calibration_of_set
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.windows.dead_band import dead_band_messages


def undetermined_parameters(explanation: Explanation) -> list[str]:
    """Full names of parameters of the causes found that the rows do not determine."""
    out = []
    for cause in explanation.probable_causes:
        if cause.name not in catalogue():
            continue
        estimates = found_effects.parameter_estimates(explanation, cause)
        for _, group in cause.members:
            missing = [n for n in group.names if n not in estimates]
            out += [f"{cause.name}.{name}" for name in missing]
    return out


def limitations(explanation: Explanation) -> tuple[str, ...]:
    """Sentences on what the recording does not determine, and on what hides values."""
    out = list(explanation.prepared.checked.unused)
    block = explanation.source.block
    out += dead_band_messages(block, explanation.rows.y)
    numbers = calibration_of_set(explanation, explanation.best.set)
    for name, first in (("accelerometers", 0), ("gyroscopes", 3)):
        if explanation.rows.used[:, first : first + 3].any():
            spare = _degrees_of_freedom(explanation, first)
            if spare <= 1:
                spares = "1 degree" if spare == 1 else "0 degrees"
                out.append(
                    f"{spares} of freedom in the means of the {name}:"
                    " their residual says nothing about the fit; take more positions"
                )
    loose = [
        name
        for name, (_, sigma, size) in numbers.items()
        if not sigma < thresholds.USEFUL[group_of(name)] * size
    ]
    if loose:
        out.append(f"not determined by these positions: {', '.join(loose)}")
    return tuple(out)


def _degrees_of_freedom(explanation: Explanation, first: int) -> int:
    """Number of window means less number of parameters, for one triad."""
    rows, posterior = explanation.rows, explanation.best.set.state
    part = slice(first, first + 3)
    held = [
        rows.used[rows.x.position == p][:, part].any(axis=0).sum()
        for p in explanation.dictionary.window_positions
    ]
    free = explanation.dictionary.unoriented
    turns = 2 * int(free.sum()) if first == 0 else 0
    reach = np.zeros(explanation.dictionary.width, dtype=bool)
    for one in explanation.best.linear:
        if first <= one.channel < first + 3:
            reach[one.columns] |= np.abs(one.design).max(axis=0) > 0
    for cause, group in explanation.best.set.members:
        if not cause.reportable:  # noise is no parameter
            reach[group.columns] = False
    narrowed = (
        np.diag(posterior.inverse) < thresholds.DETERMINED * posterior.prior_sigma**2
    )
    return int(sum(held) - turns - (reach[posterior.columns] & narrowed).sum())
