"""How quickly a device leans in each stop, as far as its accelerometers show it.

The force across its mean has in a stop of n rows the noise s, and besides it the mean
square a^2 of a random walk of the angle. Its first cosine is then

    b = a sqrt(12) / pi                                                             (1)

as a walk's cosine k has a k-th of the first one, and sum 1 / k^2 = pi^2 / 6. A cosine
has the noise s sqrt(2 / n), so those up to

    k = b / s sqrt(n / 2)                                                           (2)

exceed it: quicker ones take time and change nothing.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.rows.averages import Rows


def lean_modes(rows: Rows) -> Index:
    """Cosines that each position's rows show, (p,); none where its angles are set."""
    free = rows.used[:, :3].all(axis=1) & ~rows.x.oriented & (rows.x.position >= 0)
    out = np.zeros(int(rows.x.position.max(initial=-1)) + 1, dtype=np.intp)
    for p in np.unique(rows.x.position[free]):
        inside = free & (rows.x.position == p)
        out[p] = _modes(rows.y[inside, :3], rows.sd[inside, :3])
    return out


def _modes(force: Array, noise: Array) -> int:
    """Cosines of one stop, of its outputs (n, 3) and what these scatter by."""
    n, mean = len(force), force.mean(axis=0)
    if n < 3:
        return 0
    across = np.eye(3) - np.outer(mean, mean) / (mean @ mean)
    white = float((noise**2).mean())
    square = float((((force - mean) @ across) ** 2).sum()) / (2 * (n - 1)) - white
    first = np.sqrt(12 * max(square, 0.0)) / np.pi  # (1)
    return int(np.clip(np.ceil(first * np.sqrt(n / 2 / white)), 1, n - 1))  # (2)
