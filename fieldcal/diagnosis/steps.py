"""All instants at which biases may have jumped, tried at once.

For a column u of the design, added to a fit with Jacobian J and normal matrix A, all
whitened, its own information is G = u^T u - u^T J A^-1 J^T u and its pull b = u^T r;
with a prior of size s it raises ln Z by

    (b^2 / (G + s^-2) - ln(1 + s^2 G)) / 2

Each channel may jump or not, one as likely as the other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.reduce import Rows, Source
from fieldcal.samples import Array

UNLIKELY = 1e-4
"""Odds below which an instant is left out."""


def jump_instant(
    source: Source, bench: Bench, without: Fit, fit: Fit, term: Term
) -> tuple[float, float]:
    """Instant of a jump and its standard uncertainty.

    The odds of every instant between two rows say where it is; if that is inside one
    window, the samples there say it closer.

    Parameters
    ----------
    bench : the rows
    without, fit : the model without and with the jump

    """
    x = bench.rows.x
    gains = step_gains(bench, without, term.columns, bench.prior_of(term))
    length = np.diff(x.t)
    chance = length * np.exp(gains - gains.max())
    chance /= chance.sum()
    middle = (x.t[1:] + x.t[:-1]) / 2
    likely = np.flatnonzero(chance > UNLIKELY)
    near = np.arange(max(likely[0] - 1, 0), min(likely[-1] + 3, len(x)))
    if len(np.unique(x.position[near])) == 1:
        return _among_samples(source, bench.rows, fit, term, near)
    at = float(chance @ middle)
    spread = chance @ ((middle - at) ** 2 + length**2 / 12)
    return at, float(np.sqrt(spread))


def _among_samples(
    source: Source, rows: Rows, fit: Fit, term: Term, near: NDArray[np.intp]
) -> tuple[float, float]:
    """The same from the samples of some rows.

    With the jump h known, the odds of each instant follow from the samples' residuals
    r without it: ln p(k) = -sum_{i >= k} (h^2 - 2 h r_i) / (2 s^2).
    """
    block, x = source.block, rows.x
    first, last = np.searchsorted(block.t, x.t[[near[0], near[-1]]])
    span = slice(int(first), int(last))
    h = np.zeros(6)
    h[list(term.columns)] = fit.state.values[fit.terms.index(term)][: len(term.columns)]
    late = replace(fit.state, terms=tuple(_never(t) for t in fit.terms))
    level = late.predict(x)[near[0]]
    usable = source.usable[span]
    rest = np.where(usable, block.six[span] - level, 0.0)
    odds = np.where(usable, (h**2 - 2 * h * rest) / (2 * rows.noise**2), 0.0)
    chance = -np.cumsum(np.nan_to_num(odds).sum(axis=1)[::-1])[::-1]
    weight = np.exp(chance - chance.max())
    weight /= weight.sum()
    t = block.t[span]
    mean, step = float(weight @ t), float(np.median(np.diff(t)))
    return mean, float(np.sqrt(weight @ (t - mean) ** 2 + step**2 / 3))


def _never(term: Term) -> Term:
    return replace(term, shape={"at_s": np.inf}) if "at_s" in term.shape else term


def step_gains(
    bench: Bench, fit: Fit, channels: tuple[int, ...], sizes: Array
) -> Array:
    """Rise of ln Z for a jump after each row but the last, (n - 1,).

    Parameters
    ----------
    channels : outputs that jump together
    sizes : prior of each channel's jump

    """
    n = len(bench.rows.x)
    after = np.tri(n, n - 1, -1)
    total = np.zeros(n - 1)
    for c, size in zip(channels, sizes, strict=True):
        column = bench.whiten.channel(after, c)
        shared = fit.jacobian[:, c].T @ column
        own = (column**2).sum(axis=0)
        own -= (shared * (fit.covariance @ shared)).sum(axis=0)
        pull = column.T @ fit.white[:, c]
        own = np.maximum(own, 0.0)
        gain = 0.5 * (pull**2 / (own + size**-2) - np.log1p(size**2 * own))
        total += np.logaddexp(0.0, gain) - np.log(2.0)
    return total
