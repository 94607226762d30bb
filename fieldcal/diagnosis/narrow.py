"""An effect on fewer axes, or far smaller, than the catalogue has it.

From the estimate m with covariance C under one prior S follows the evidence under
another, and for fewer parameters: with the rows' own information L = C^-1 - S^-1 on
the term and their pull b = C^-1 m,

    ln Z(S) = b^T (L + S^-1)^-1 b / 2 - ln det(1 + S L) / 2 + const

taken over the parameters kept. So axes of an effect on the sensors that have nothing of
it cost nothing, and an effect a thousandth of its typical size is not overlooked; for
choosing among the cases their number is paid.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.model import Term
from fieldcal.effects import Sensor
from fieldcal.samples import Array

TIGHT = (10.0, 1.0, 0.1, 0.01, 0.001)
"""Priors tried, in typical sizes."""


def narrower(
    bench: Bench, fit: Fit, term: Term
) -> tuple[tuple[int, ...], float, float, float]:
    """The parameters to keep and their prior.

    Returns
    -------
    columns : of the term
    tight : prior in typical sizes
    gain : rise of ln Z over the fit's own
    cost : of the choice, ln

    """
    if not term.columns:
        return term.columns, term.tight, 0.0, 0.0
    names = [f"{term.effect.id}.{n}" for n in term.names]
    at = [fit.names.index(n) for n in names]
    own = np.linalg.inv(fit.covariance[np.ix_(at, at)])
    pull, size = own @ fit.values[at], bench.prior_of(term) ** 2
    rows = own - np.diag(1 / size)
    whole = float(_evidence(rows, pull, size[None], list(range(len(at))))[0])
    subsets = _subsets(fit, term, at)
    sizes = np.square(TIGHT)[:, None] * size
    cases = np.array([_evidence(rows, pull, sizes, kept) for kept in subsets])
    best = np.unravel_index(int(np.argmax(cases)), cases.shape)
    kept, tight, found = subsets[best[0]], TIGHT[best[1]], float(cases[best])
    columns = tuple(term.columns[i] for i in kept)
    return columns, term.tight * tight, found - whole, float(np.log(cases.size))


def _evidence(rows: Array, pull: Array, size: Array, kept: list[int]) -> Array:
    """Ln Z for some parameters, under each of the priors (p, k); (p,)."""
    s, b, some = size[:, kept], pull[kept], rows[np.ix_(kept, kept)]
    one = np.eye(len(kept))
    inner = some + one / s[:, :, None]
    inside = one + np.sqrt(s[:, :, None] * s[:, None, :]) * some
    squares = 0.5 * (np.linalg.solve(inner, b[:, None])[:, :, 0] @ b)
    out: Array = squares - 0.5 * np.linalg.slogdet(inside)[1]
    return out


def _subsets(fit: Fit, term: Term, at: list[int]) -> list[list[int]]:
    """Parameters of every choice of axes; all of them for an effect on motion."""
    everything = list(range(len(at)))
    if not isinstance(term.effect, Sensor):
        return [everything]
    strength = (fit.jacobian[:, :, at] ** 2).sum(axis=0)
    axis = np.argmax(strength, axis=0)
    axes = sorted(set(axis.tolist()))
    out = []
    for n in range(1, len(axes) + 1):
        for some in combinations(axes, n):
            out.append([i for i in everything if axis[i] in some])
    return out
