"""The position that decides between two explanations: where they differ most.

Only positions are considered that the ladder of the session can be set to: the angles
that were used, with either sign, and zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.positions import Position, ladder_settings
from fieldcal.core.samples import Array
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model import thresholds
from fieldcal.model.causes.planned import rows_at_session_end
from fieldcal.model.evidence.sets import Set
from fieldcal.model.state import State


@dataclass(frozen=True, slots=True)
class DecidingPosition:
    """A position at which two explanations differ.

    Attributes
    ----------
    alpha_deg, beta_deg : its angles
    apart : difference of the explanations there, standard deviations of a window's mean
    number : number of that position in the session, from 1; 0 for a new position

    """

    alpha_deg: float
    beta_deg: float
    apart: float
    number: int

    @property
    def text(self) -> str:
        """Request to the operator, as part of a sentence."""
        angles = f"α = {self.alpha_deg:g}°, β = {self.beta_deg:g}°"
        if self.number:
            return f"repeat position {self.number} ({angles}) at the end"
        return f"add the position {angles}"


def ladder_extent(positions: Sequence[Position]) -> str:
    """Largest angles of the session's ladder, for a sentence."""
    a, b = (
        max(map(abs, joint)) for joint in zip(*ladder_settings(positions), strict=True)
    )
    return f"within |α| ≤ {a:g}°, |β| ≤ {b:g}°"


def median_known(rows: Array) -> Array:
    """Median of each column (k,); nan for an output that was not recorded."""
    out = np.full(rows.shape[1], np.nan)
    known = np.isfinite(rows).any(axis=0)
    out[known] = np.nanmedian(rows[:, known], axis=0)
    return out


def deciding_position(
    explanation: Explanation, one: str, other: str
) -> DecidingPosition | None:
    """Position of the session's ladder at which two explanations differ most.

    None if no position of the ladder decides, or if the angles are not known.
    """
    rows, instead = explanation.rows, explanation.posterior.alternatives.get(one, {})
    if other not in instead or not rows.x.oriented.all():
        return None
    states = [_state(explanation, s) for s in (explanation.best.set, instead[other])]
    x = rows.x
    sd = median_known(rows.sd)
    sd = sd / np.sqrt(len(x) / len(explanation.dictionary.window_positions))
    sd = np.hypot(sd, median_known(rows.window_error))
    since = explanation.dictionary.since[:, -1:]
    about = explanation.source.about
    held = [p.degrees for p in about.positions]
    best: DecidingPosition | None = None
    for alpha, beta in ladder_settings(about.positions):
        place = rows_at_session_end(x, *np.deg2rad([[alpha], [beta]]))
        outputs = [s.output(s.experienced(place), since) for s in states]
        apart = float(np.nanmax(np.abs(outputs[0] - outputs[1]) / sd))
        if best is None or apart > best.apart * thresholds.CLEARLY_FURTHER:
            at = [i for i, angles in enumerate(held) if angles == (alpha, beta)]
            number = about.indices_in_file(at[:1])[0] + 1 if at else 0
            best = DecidingPosition(alpha, beta, apart, number)
    return best if best is not None and best.apart > thresholds.DECIDES else None


def _state(explanation: Explanation, fitted: Set) -> State:
    """The state at a set's estimates, without errors of single orientations."""
    state, _ = explanation.inferred.fit.state_at_estimate(fitted)
    return replace(state, small_rotation=np.zeros_like(state.small_rotation))
