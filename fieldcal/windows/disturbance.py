"""Whether a window was disturbed: at what instant, on which axis, by how much.

    y_i                                    means of cells, i = 1 .. m
    u_k,i = mean of 2^k cells from cell i                    running mean of level k
    a_k   = median |u_k,i+2^k - u_k,i| / (0.6745 sqrt(2))    robust Allan deviation
    s_k^2 = sum over j >= k of a_j^2 / 2                     spread about the mean
    z_k,i = (u_k,i - median y) / s_k

Differences of neighbours know nothing of a step or a lean but at its edge, so a_k is
the device's own noise even in a window that was disturbed. Levels too long to be
measured in the window are continued from the shorter ones. The sum over the levels is
exact for any stationary noise (Haar analysis of variance; white noise: s_k = a_k).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.errors import Moved
from fieldcal.samples import CHANNELS, Array
from fieldcal.windows.cells import CELL

LEVELS = 8
"""Durations looked for: 0.1 s to 12.8 s, each twice the one before."""

THRESHOLD = 6.5
"""Deviation, in spreads of the noise, that noise alone does not reach."""

_NORMAL = 0.6745 * np.sqrt(2.0)


@dataclass(frozen=True, slots=True)
class Deviation:
    """The largest deviation of a window from its own middle.

    Attributes
    ----------
    ratio : deviation as part of what is allowed; above 1 is a disturbance
    cell : first cell of the deviation
    level : its duration is 2^level cells
    channel : index in `CHANNELS`
    size, noise : the deviation and its standard deviation by noise, SI

    """

    ratio: float
    cell: int
    level: int
    channel: int
    size: float
    noise: float

    def error(self, times: Array) -> Moved:
        """Return the error that tells the operator."""
        axis = CHANNELS[self.channel]
        unit = "m/s²" if self.channel < 3 else "rad/s"
        at = float(times[self.cell])
        text = (
            f"disturbed {at - times[0]:.1f} s into the window on {axis}: "
            f"{CELL * 2**self.level:.1f} s of {self.size:+.2g} ± {self.noise:.1g} "
            f"{unit}, {abs(self.size) / self.noise:.0f} times the noise; hold still, "
            "the window starts again"
        )
        return Moved(text, at, axis)


def largest_deviation(means: Array) -> Deviation | None:
    """Return the most significant deviation in cell means (m, 6); None in too few."""
    if len(means) < 2:
        return None
    filled = _filled(means)
    sums = np.vstack([np.zeros((1, 6)), np.cumsum(filled, axis=0)])
    levels = [k for k in range(LEVELS) if 2**k <= len(means) // 2]
    running = [(sums[2**k :] - sums[: -(2**k)]) / 2**k for k in levels]
    spread = _spread(running)
    middle = np.median(filled, axis=0)
    best: Deviation | None = None
    for k in levels:
        deviation = running[k] - middle
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.nan_to_num(np.abs(deviation) / (THRESHOLD * spread[k]))
        i, c = np.unravel_index(np.argmax(ratio), ratio.shape)
        if best is None or ratio[i, c] > best.ratio:
            best = Deviation(
                float(ratio[i, c]),
                int(i),
                k,
                int(c),
                float(deviation[i, c]),
                float(spread[k][c]),
            )
    return best


def _spread(running: list[Array]) -> list[Array]:
    """Spread (6,) of the running means of each level about the mean, by noise."""
    allan: list[Array] = []
    for k, u in enumerate(running):
        pairs = u[2**k :] - u[: -(2**k)]
        if k and len(u) < 10 * 2**k:
            allan.append(allan[-1] / np.sqrt(2))
        else:
            allan.append(np.median(np.abs(pairs), axis=0) / _NORMAL)
    beyond = allan[-1] ** 2 / 2
    variance = []
    for a in reversed(allan):
        beyond = beyond + a**2 / 2
        variance.append(beyond)
    return [np.sqrt(v) for v in reversed(variance)]


def _filled(means: Array) -> Array:
    """Cell means with the value before where one is missing, zeros where all are."""
    known = np.isfinite(means)
    row = np.where(known, np.arange(len(means))[:, None], 0)
    last = np.maximum.accumulate(row, axis=0)
    return np.nan_to_num(np.take_along_axis(means, last, axis=0))
