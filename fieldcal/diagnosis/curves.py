"""Residuals over what they follow, before and after: the pictures of a diagnosis.

For each mismatch in the windows, the residual of the simulation alone and that of the
simulation with the effects found, averaged over parts of windows, with its standard
deviation from white noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.diagnosis.agreement import Agreement
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.parts import averages
from fieldcal.diagnosis.result import Mismatch, number
from fieldcal.model.reduce import Rows


@dataclass(frozen=True, slots=True)
class Curve:
    """A channel's residual over a covariate.

    Attributes
    ----------
    channel : name in `samples.CHANNELS`
    covariate, unit : what it is drawn over
    x : (m,) the covariate
    position : (m,) of session.toml
    before, after : (m,) residuals, m/s^2 or rad/s
    sigma : (m,) their standard deviation from white noise

    """

    channel: str
    covariate: str
    unit: str
    x: Array
    position: NDArray[np.intp]
    before: Array
    after: Array
    sigma: Array

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        columns = ("x", "before", "after", "sigma")
        return {
            "channel": self.channel,
            "covariate": self.covariate,
            "unit": self.unit,
            "position": [int(p) for p in self.position],
            **{n: [number(v) for v in getattr(self, n)] for n in columns},
        }


def curves(
    explanation: Explanation,
    mismatch: Sequence[Mismatch],
    first: Agreement,
    then: Agreement,
) -> Iterator[Curve]:
    """One curve for each channel and covariate in which the windows part."""
    source = explanation.prepared.source
    start = source.warmth.start_c
    done = set()
    for m in mismatch:
        name, unit = NAMES.get(m.kind, ("", ""))
        if not name or m.channel not in CHANNELS or (m.channel, name) in done:
            continue
        done.add((m.channel, name))
        c = CHANNELS.index(m.channel)
        rows = first.rows
        before, sd, position = averages(rows, first.residual)
        after = averages(then.rows, then.residual)[0]
        position = np.array(source.about.numbered(position))
        x = _mean(rows, COVARIATES[name](rows)) + (start if unit == "°C" else 0.0)
        if name == "position":
            x = position.astype(float)
        yield Curve(
            m.channel, name, unit, x, position, before[:, c], after[:, c], sd[:, c]
        )


NAMES: Mapping[str, tuple[str, str]] = {
    "position": ("position", ""),
    "samples": ("time", "s"),
    "time": ("time", "s"),
    "temperature": ("temperature", "°C"),
    "transient": ("time since the turn", "s"),
}
"""What the residual of a kind of mismatch is drawn over, and its unit."""

COVARIATES: Mapping[str, Callable[[Rows], Array]] = {
    "position": lambda rows: rows.x.position.astype(float),
    "time": lambda rows: rows.x.t,
    "temperature": lambda rows: rows.x.warming,
    "time since the turn": lambda rows: rows.x.since_turn,
}


def _mean(rows: Rows, values: Array) -> Array:
    """Means of something known in each row over the same parts of windows."""
    six = np.broadcast_to(values[:, None], rows.y.shape)
    mean = averages(rows, six)[0]
    known = np.isfinite(mean)
    weight = np.where(known, mean, 0.0).sum(axis=1)
    out: Array = weight / np.maximum(known.sum(axis=1), 1)
    return out
