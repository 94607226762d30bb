"""Whether axes that seem to wander follow one course, as biases never do.

With r the residuals of the axes' cells (parts of windows), X what the model leaves free
and S their white noise, two descriptions of the rest are compared,

    V = S + diag(v^2) x K     each axis for itself
    V = S + a a^T x K         one course, of which each axis has its part

K being the covariance of a walk in time, or of one value for each position. Restricted
likelihood, at the best v and a:

    ln L = -1/2 [ln det V + ln det (X^T V^-1 X + P) + r^T V^-1 (r - X b)]

P is the prior's information on X. Source: Searle, Casella, McCulloch, Variance
Components, chapter 6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.heldout import cells
from fieldcal.samples import Array

MOST_CELLS = 160
"""Of one axis; of longer recordings the first so many tell."""

FEWEST_CELLS = 24
"""Of one axis, if the recording has so many rows."""

EARLY = 1.5
"""Cells at the start of a window are shorter: what happens after a turn is there."""

STEPS = 120
"""Evaluations of one likelihood at most."""

FLOOR = 1e-3
"""Smallest scatter that is looked at, of the largest residual."""


RIDGE = 1e-9
"""Information on what the cells do not tell, so that it can be solved for."""


@dataclass(frozen=True, slots=True)
class _Scene:
    """Residuals (m,), design (m, k), white noise (m,), prior's information (k, k).

    `channel` and `position` are (m,); `t` the cells' middles, s.
    """

    residual: Array
    design: Array
    sd: Array
    prior: Array
    channel: Array
    position: Array
    t: Array

    def kernel(self, walk: bool) -> Array:
        """K: of a walk by 1 a session, or of a value for each position."""
        if not walk:
            same: Array = np.equal.outer(self.position, self.position).astype(float)
            return same
        part = (self.t - self.t.min()) / max(float(np.ptp(self.t)), 1e-9)
        both: Array = np.minimum.outer(part, part)
        return both

    def likelihood(self, random: Array) -> float:
        """Ln L with some covariance of the random part, (m, m)."""
        try:
            lower = np.linalg.cholesky(random + np.diag(self.sd**2))
        except np.linalg.LinAlgError:
            return -np.inf
        r = np.linalg.solve(lower, self.residual)
        x = np.linalg.solve(lower, self.design)
        inner = x.T @ x + self.prior
        pull = x.T @ r
        squares = float(r @ r - pull @ np.linalg.solve(inner, pull))
        log_det = 2 * np.log(np.diag(lower)).sum() + np.linalg.slogdet(inner)[1]
        return -0.5 * (float(log_det) + squares)


def together(bench: Bench, fit: Fit, axes: list[int]) -> float:
    """By how much one course of several axes is likelier than one for each, ln.

    `fit` has white noise only; `axes` are the channels that wander.
    """
    scene = _scene(bench, fit, axes)
    apart, one = -np.inf, -np.inf
    for walk in (True, False):
        apart = max(apart, _best(scene, walk, axes, _separate))
        one = max(one, _best(scene, walk, axes, _common))
    return one - apart


def _scene(bench: Bench, fit: Fit, axes: list[int]) -> _Scene:
    rows = bench.rows
    each = max(4, -(-FEWEST_CELLS // bench.windows))
    ends = (np.linspace(0, 1, each + 1) ** EARLY).tolist()
    mean, sd, position = cells(rows, fit.residual, ends)
    t = cells(rows, np.repeat(rows.x.t[:, None], 6, axis=1), ends)[0]
    columns = [cells(rows, c, ends)[0] for c in np.moveaxis(fit.design, 2, 0)]
    flat = fit.jacobian.reshape(-1, len(fit.names))
    prior = np.diag(np.linalg.inv(fit.covariance) - flat.T @ flat)
    parts = []
    for c in axes:
        known = np.flatnonzero(np.isfinite(mean[:, c]))[:MOST_CELLS]
        parts.append((c, known))
    sd = np.concatenate([sd[k, c] for c, k in parts])
    design = [np.column_stack([d[k, c] for d in columns]) for c, k in parts]
    whole = np.concatenate(design)
    strength = np.linalg.norm(whole / sd[:, None], axis=0)
    told = strength > 0
    prior = np.maximum(prior[told] / strength[told] ** 2, RIDGE)
    return _Scene(
        np.concatenate([mean[k, c] for c, k in parts]),
        whole[:, told] / strength[told],
        sd,
        np.diag(prior),
        np.concatenate([np.full(len(k), c) for c, k in parts]),
        np.concatenate([position[k] for _, k in parts]),
        np.concatenate([t[k, c] for c, k in parts]),
    )


def _separate(scene: _Scene, sizes: Array, axes: list[int]) -> Array:
    """Diag(v^2) over the cells, to be multiplied by K."""
    v = np.array([sizes[axes.index(int(c))] for c in scene.channel])
    same = np.equal.outer(scene.channel, scene.channel)
    out: Array = np.where(same, np.outer(v, v), 0.0)
    return out


def _common(scene: _Scene, sizes: Array, axes: list[int]) -> Array:
    """A a^T over the cells, to be multiplied by K."""
    a = np.array([sizes[axes.index(int(c))] for c in scene.channel])
    out: Array = np.outer(a, a)
    return out


def _best(
    scene: _Scene,
    walk: bool,
    axes: list[int],
    shape: Callable[[_Scene, Array, list[int]], Array],
) -> float:
    """Ln L at the best sizes."""
    from scipy.optimize import minimize

    kernel = scene.kernel(walk)
    unit = float(np.abs(scene.residual).max())
    level = np.array(
        [np.sqrt(np.mean(scene.residual[scene.channel == c] ** 2)) for c in axes]
    )

    def less(sizes: Array) -> float:
        return -scene.likelihood(kernel * shape(scene, sizes * unit, axes))

    start = min(_starts(level / unit, shape is _common), key=less)
    options = {"maxfev": STEPS, "xatol": FLOOR, "fatol": 0.1}
    return -float(minimize(less, start, method="Nelder-Mead", options=options).fun)


def _starts(level: Array, signed: bool) -> list[Array]:
    """Sizes to begin with: as the residuals are, with every choice of signs."""
    if not signed:
        return [level]
    out = []
    for code in range(2 ** (len(level) - 1)):
        signs = [1.0] + [1.0 - 2.0 * (code >> j & 1) for j in range(len(level) - 1)]
        out.append(level * np.array(signs))
    return out
