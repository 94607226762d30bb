"""How well a recording shows that angles are set.

It shows it by their scatter, which a diagnosis finds; and what accelerometers are
off by from position to position for no known reason may be an angle too:

    sigma = max_c sqrt(mean_p o_pc^2) / g                                          (1)

with the offset o_pc of output c in position p. The accelerometers cannot tell which of
the two it is, and the turns between the positions are off by an angle alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.found_effects import sizes
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Scatter

ACC = 3
"""Outputs of accelerometers, the first ones of all."""

BY_POSITION = ("window", "position", "alpha", "beta", "joints", "force")
"""Functions without physics that go with how the device lies."""


def angles_set(explanation: Explanation) -> float:
    """How well a recording shows that angles are set, deg; 0 if it shows nothing."""
    found = [0.0]
    for one in explanation.standing:
        effect = catalogue().get(one.name)
        if isinstance(effect, Scatter) and {p.unit for p in effect.params} == {"deg"}:
            told = sizes(explanation, one).values()
            found += [q.value for q in told if isinstance(q.value, float)]
    return max(found)


def angles_of_offsets(explanation: Explanation) -> float:
    """Angles that offsets without a known cause may be, deg; 0 if there are none."""
    x, d = explanation.rows.x, explanation.dictionary
    unknown = [
        group.columns
        for one in explanation.standing
        if one.kind == "unknown" and one.name in BY_POSITION
        for _, group in one.members
    ]
    if not unknown or not x.oriented.any():
        return 0.0
    fitted = replace(explanation.best, set=explanation.posterior.best)
    whole, less = fitted.estimate, fitted.estimate
    less[np.concatenate(unknown)] = 0.0
    off = (fitted.residual(less) - fitted.residual(whole))[:, :ACC] / d.unit[:ACC]
    held = np.unique(x.position[x.oriented])
    mean = np.array([np.nan_to_num(off[x.position == p]).mean(axis=0) for p in held])
    size = np.sqrt((mean**2).mean(axis=0)).max() / x.gravity  # (1)
    return float(np.rad2deg(size))
