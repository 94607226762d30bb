"""All instants at which biases may have jumped, tried at once.

For a column u of the design, added to a fit with Jacobian J and normal matrix A, all
whitened, its own information is G = u^T u - u^T J A^-1 J^T u and its pull b = u^T r;
with a prior of size s it raises ln Z by

    (b^2 / (G + s^-2) - ln(1 + s^2 G)) / 2

Each channel may jump or not, one as likely as the other.
"""

from __future__ import annotations

import numpy as np

from fieldcal.diagnosis.fit import Bench, Fit
from fieldcal.samples import Array


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
