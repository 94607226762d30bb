"""How well a model predicts what it has not seen.

Each position in turn is left out, the rest fitted, and the position predicted from
that; with fewer than three windows, stretches of time are left out instead. Where a
position's angles are free or random, what they make up for does not count against the
prediction. Random parts that reach from the rest into what is left out (a walk) predict
it as far as they do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.model import State, Term
from fieldcal.diagnosis.reduce import Rows
from fieldcal.samples import Array

FOLDS = 12
FEW = 3
"""Windows below which stretches of them are left out instead."""

LONG, SHORT = 5, 24
"""How many: what is random foretells for a short time only, causes for long."""

CELLS = (0.0, 0.1, 0.25, 0.5, 1.0)
"""Parts of a window over which residuals are averaged before their rms is taken."""

ANEW = 3
"""Times that the orientation of a position left out is found anew."""


def held_out(
    bench: Bench, terms: Sequence[Term], fit: Fit, stretches: int = LONG
) -> Array:
    """Residuals of rows predicted from the others, (n, 6); nan where none can be."""
    by_position = _residuals(bench, terms, fit, _positions(bench.rows))
    if np.isfinite(by_position).any():
        return by_position
    return _residuals(bench, terms, fit, _stretches(bench.rows, stretches))


def foretold(bench: Bench, terms: Sequence[Term], fit: Fit) -> float:
    """How likely a model makes what it has not seen, ln, but for a common constant.

    The sum over the parts left out of ln p(part | rest) = ln Z(all) - ln Z(rest), with
    whatever the random parts and the uncertainty of the parameters leave open. Source:
    A. Vehtari, J. Ojanen, A survey of Bayesian predictive methods, 2012, section 5.
    """
    rows = bench.rows
    fold = _positions(rows)
    fold = fold if fold.max() else _stretches(rows, LONG)
    total = 0.0
    for i in np.unique(fold):
        rest = bench.but(rows=rows.without(fold == i)).fit(terms, fit)
        total += fit.score - rest.score
    return total


def _positions(rows: Rows) -> NDArray[np.intp]:
    held, index = np.unique(rows.x.position, return_inverse=True)
    if len(held) < FEW:
        return np.zeros(len(index), dtype=np.intp)
    fold: NDArray[np.intp] = (index % FOLDS).astype(np.intp)
    return fold


def _stretches(rows: Rows, count: int) -> NDArray[np.intp]:
    out = np.zeros(len(rows.x), dtype=np.intp)
    for p in np.unique(rows.x.position):
        inside = np.flatnonzero(rows.x.position == p)
        for i, part in enumerate(np.array_split(inside, count)):
            out[part] = i
    return out


def _residuals(
    bench: Bench, terms: Sequence[Term], fit: Fit, fold: NDArray[np.intp]
) -> Array:
    rows, out = bench.rows, np.full(bench.rows.y.shape, np.nan)
    if fold.max() == 0:
        return out
    told = _told(fit)
    for i in np.unique(fold):
        left = fold == i
        seen = bench.but(rows=rows.without(left)).fit(terms, fit)
        if told - _told(seen):
            continue
        out[left] = _apart(bench, _oriented(bench, fit, seen, left), left)[left]
    return np.where(rows.used, out, np.nan)


def _told(fit: Fit) -> set[str]:
    """Names of the columns that a fit determines, positions' own turns aside."""
    pairs = zip(fit.names, fit.determined, strict=True)
    return {n for n, known in pairs if known and not n.startswith("aside")}


def _reached(bench: Bench, left: NDArray[np.bool_], apart: Array) -> Array:
    """What random parts carry over from the rows that were seen.

    With K the covariance of all rows, what is left of a part p of them once the others
    have told of it is (K^-1)_pp^-1 (K^-1 r)_p.
    """
    out = np.zeros_like(apart)
    for c, root in bench.whiten.roots.items():
        use = bench.rows.used[:, c]
        at = np.flatnonzero(left & use)
        own = root[:, left[use]]
        alone = np.linalg.solve(own.T @ own, own.T @ (root @ apart[use, c]))
        out[at, c] = apart[at, c] - alone
    return out


def _oriented(bench: Bench, fit: Fit, seen: Fit, left: NDArray[np.bool_]) -> State:
    """A model of the rest, with the positions left out turned as they show it.

    Unless orientations are known for sure, two small turns of each are its own; of one
    left out in part, the rest shows them.
    """
    state = seen.state
    if not bench.leeway.any():
        return state
    rows = bench.rows
    places = np.setdiff1d(rows.x.position[left], rows.x.position[~left])
    places = places[bench.leeway[places] > 0]
    aside = state.aside.copy()
    aside[places] = fit.state.aside[places]
    for _ in range(ANEW if bench.free else 1):
        state = replace(state, aside=aside.copy())
        apart, turned = _apart(bench, state, left), bench.aside(state)
        for p in places:
            use = rows.used & (rows.x.position == p)[:, None]
            a = turned[:, :, 2 * p : 2 * p + 2][use] / rows.sd[use][:, None]
            z = apart[use] / rows.sd[use]
            pull = a.T @ z - aside[p] / bench.leeway[p] ** 2
            aside[p] += np.linalg.solve(
                a.T @ a + np.eye(2) / bench.leeway[p] ** 2, pull
            )
    return replace(state, aside=aside)


def _apart(bench: Bench, state: State, left: NDArray[np.bool_]) -> Array:
    """Residuals of what was left out, less what random parts carry over."""
    apart = bench.rows.y - state.predict(bench.rows.x)
    return apart - _reached(bench, left, apart)


def cells(
    rows: Rows, residual: Array, parts: Sequence[float] = CELLS
) -> tuple[Array, Array, NDArray[np.intp]]:
    """Means over parts of the windows, the parts being given by their ends.

    Returns
    -------
    mean : (m, 6) weighted mean residuals; nan where there is none
    sd : (m, 6) their standard deviation from white noise
    position : (m,)

    """
    means, sds, position = [], [], []
    for p in np.unique(rows.x.position):
        at = np.flatnonzero(rows.x.position == p)
        cuts = np.unique(np.round(np.array(parts) * len(at)).astype(int))
        for a, b in zip(cuts[:-1], cuts[1:], strict=True):
            part = at[a:b]
            use = np.isfinite(residual[part]) & rows.used[part]
            weight = np.where(use, 1 / np.where(use, rows.sd[part], 1.0) ** 2, 0.0)
            total = weight.sum(axis=0)
            some = np.where(total > 0, total, np.nan)
            means.append((weight * np.nan_to_num(residual[part])).sum(axis=0) / some)
            sds.append(np.hypot(1 / np.sqrt(some), rows.common[part[0]]))
            position.append(p)
    return np.array(means), np.array(sds), np.array(position, dtype=np.intp)


def rms(rows: Rows, residual: Array, stretches: int = LONG) -> Array:
    """Root mean square of the cells' residuals, (6,); nan where there is none.

    The cells of a few long windows are as short as the stretches left out.
    """
    few = len(np.unique(rows.x.position)) < FEW and stretches == SHORT
    even = np.linspace(0.0, 1.0, stretches + 1).tolist()
    mean, _, _ = cells(rows, residual, even if few else CELLS)
    count = np.isfinite(mean).sum(axis=0)
    squares = np.nansum(mean**2, axis=0)
    return np.sqrt(np.where(count > 0, squares / np.maximum(count, 1), np.nan))
