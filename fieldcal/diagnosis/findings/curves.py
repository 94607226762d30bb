"""Residuals over their covariate, before and after: the plots of a diagnosis.

For each mismatch in the windows, the residual of the simulation alone and that of the
simulation with the effects found, averaged over parts of windows, with its standard
deviation from white noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.agreement import ModelResiduals, part_means
from fieldcal.diagnosis.result import Curve, Mismatch
from fieldcal.model.rows.averages import Rows


def residual_curves(
    explanation: Explanation,
    mismatch: Sequence[Mismatch],
    first: ModelResiduals,
    then: ModelResiduals,
) -> Iterator[Curve]:
    """One curve for each channel and covariate of the mismatches in the windows."""
    source = explanation.source
    start = source.thermometer.start_c
    done = set()
    for m in mismatch:
        name, unit = CURVE_AXES.get(m.kind, ("", ""))
        if not name or m.channel not in CHANNELS or (m.channel, name) in done:
            continue
        done.add((m.channel, name))
        c = CHANNELS.index(m.channel)
        rows = first.rows
        before, sd, position = part_means(rows, first.residual)
        after = part_means(then.rows, then.residual)[0]
        position = np.array(source.about.indices_in_file(position))
        x = _covariate_means(rows, COVARIATES[name](rows)) + (
            start if unit == "°C" else 0.0
        )
        if name == "position":
            x = position.astype(float)
        yield Curve(
            m.channel, name, unit, x, position, before[:, c], after[:, c], sd[:, c]
        )


CURVE_AXES: Mapping[str, tuple[str, str]] = {
    "position": ("position", ""),
    "samples": ("time", "s"),
    "time": ("time", "s"),
    "temperature": ("temperature", "°C"),
    "transient": ("time since the turn", "s"),
}
"""Axis and its unit over which the residual of a kind of mismatch is drawn."""

COVARIATES: Mapping[str, Callable[[Rows], Array]] = {
    "position": lambda rows: rows.x.position.astype(float),
    "time": lambda rows: rows.x.t,
    "temperature": lambda rows: rows.x.warming,
    "time since the turn": lambda rows: rows.x.since_turn,
}


def _covariate_means(rows: Rows, values: Array) -> Array:
    """Means of a covariate over the same parts of windows as the residuals."""
    six = np.broadcast_to(values[:, None], rows.y.shape)
    mean = part_means(rows, six)[0]
    known = np.isfinite(mean)
    weight = np.where(known, mean, 0.0).sum(axis=1)
    out: Array = weight / np.maximum(known.sum(axis=1), 1)
    return out
