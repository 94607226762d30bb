"""Upper limit of a process that a recording does not show.

    log L(k) = max over a of log L(a S + k g)                                      (1)
    limit: the largest k with  log L(k) >= max log L - u^2 / 2,   u = 1.645        (2)

S are the expected powers of the processes that were found, g the column of the other
one, k its variance, and log L that of `likelihood`. Source: likelihood ratio, one
sided, 95 %.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import Powers
from fieldcal.noise.spectrum import CosineSpectrum

ONE_SIDED = 1.645
"""Normal deviation that is exceeded in 5 of 100."""

STEPS = 8
"""Steps in which a of (1) is found."""


def upper_limit(
    spectrum: CosineSpectrum, powers: Powers, process: str, level: Array
) -> float:
    """Size (95 %) of a process without a correlation time beside others, (2).

    Parameters
    ----------
    spectrum : of the device
    powers : of the channel
    process : symbol
    level : (b,) expected powers of the others, S

    """
    used = ~powers.free
    power, count = (a[used].sum(axis=1) for a in (powers.power, powers.count))
    column, known = spectrum.column(process)[used], level[used]
    # from a negligible size to one of a thousand times the others
    sizes = np.geomspace(1e-4, 1e4, 400) / float((column / known).max())
    other = sizes[:, None] * column
    scale = np.ones((len(sizes), 1))
    for _ in range(STEPS):
        total = scale * known + other
        gained = (known * power / total**2).sum(axis=1)
        scale *= np.sqrt(gained / (known * count / total).sum(axis=1))[:, None]
    total = scale * known + other
    likely = -0.5 * (count * np.log(total) + power / total).sum(axis=1)
    return float(np.sqrt(sizes[likely >= likely.max() - ONE_SIDED**2 / 2][-1]))
