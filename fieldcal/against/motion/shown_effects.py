"""Effects that a recording in motion shows beyond its reference, with numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.against.motion.explanation import MotionExplanation
from fieldcal.against.motion.fit import column_estimates
from fieldcal.against.result import Difference, RealAndSimulated
from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.posterior.probabilities import ProbableCause


def effect_differences(
    found: MotionExplanation, standing: Sequence[ProbableCause], state: Eliminated
) -> Iterator[Difference]:
    """Differences by the causes with a probability above one half."""
    for one in standing:
        pairs: dict[str, RealAndSimulated] = {}
        for _, group in one.members:
            for name, q in _quantities(group, state).items():
                pairs[name] = RealAndSimulated.of(q, None)
        yield Difference(
            one.name,
            "left_out",
            one.probability,
            pairs,
            tuple(n for n in one.aliases if n in catalogue()),
            tuple(_mismatches_of_cause(found, one, state)),
            explained=one.name in catalogue(),
        )


def _quantities(group: Group, state: Eliminated) -> dict[str, Quantity]:
    """Parameters of a cause that the rows determine."""
    effect = group.effect
    if effect is None:
        return {}
    value, covariance, before = column_estimates(state, group.columns)
    sigma = np.sqrt(np.diag(covariance))
    out = {
        effect.params[j].name: Quantity(float(v), float(s), effect.params[j].unit)
        for j, v, s, b in zip(group.params, value, sigma, before, strict=True)
        if s**2 < thresholds.DETERMINED * b**2
    }
    for shape in effect.shapes:
        at = float(group.shape[shape.name])
        unsure = group.shape_sigma(shape.name)
        known = unsure if np.isfinite(unsure) else None
        out[shape.name] = Quantity(at, known, shape.unit)
    return out


def _mismatches_of_cause(
    found: MotionExplanation, one: ProbableCause, state: Eliminated
) -> Iterator[Mismatch]:
    """Mismatches in the channels in which a cause is significant."""
    inferred, system = found.inferred, found.fit.system
    wanted = np.zeros(system.dictionary.width, dtype=bool)
    for _, group in one.members:
        wanted[group.columns] = True
    estimate = np.zeros(len(wanted))
    np.add.at(estimate, state.columns, state.estimate)
    effect = catalogue().get(one.name)
    rows = found.rows
    for part in system.linearised(inferred.state, wanted):
        made = part.design @ (estimate * wanted)[part.columns]
        square = float(made @ made)
        if square > thresholds.IN_CHANNEL:
            yield Mismatch(
                channel=CHANNELS[part.channel],
                kind=effect.seen_in if effect else "time",
                positions=(),
                from_s=float(rows.t[0, 0]),
                to_s=float(rows.t[-1, -1]),
                covariate=effect.covariate if effect else one.name,
                rms=float(np.sqrt(np.mean((made / part.weight) ** 2))),
                sigma=float(np.sqrt(square)),
            )
