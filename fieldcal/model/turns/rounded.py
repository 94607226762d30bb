"""Rounding on the way: gyroscopes that stand on one value while the device turns.

An output that changes from step to step is off by something else in each sample, which
averages out. One that stands on a value U of its grid of steps q is off by the same as
long as it stands there, by anything within a step. Where U is that of the windows, it
is off by what the windows are off by: their columns reach the turn, by the share of
time that it stands there. Of every other run of n samples on one value, between runs of
m and k samples,

    var of its part of the closure = (n dt / s)^2 q^2 / 12 * c                      (1)

with c = 1 where the rate turns back. Where it crosses the step, going on, it is off by
as much to one side as to the other, but for what it becomes faster or slower: then its
mean error is q / 12 (n / k - n / m), so c is the square of that bracket over 12. It is
less as far as noise reaches across a step ((2) of `windows.rounding`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block, Index
from fieldcal.model.rows.noise import rounding, steps_in

NEXT = 0.99
"""Part of a step: a mean between two values is less than one from both."""


@dataclass(frozen=True, slots=True)
class StandingOutputs:
    """Where the gyroscopes stand in the windows.

    Attributes
    ----------
    value, step : (3,) rad/s; a step is 0 where noise hides it
    variance : (3,) of the error of an output that stands, (rad/s)^2

    """

    value: Array
    step: Array
    variance: Array

    def share(self, gyr: Array, edge: Index) -> Array:
        """Share of the time about each edge in which outputs (n, 3) stand, (m + 1, 3).

        What is counted is where they stand in the windows.
        """
        there = self._there(gyr).astype(float)
        each = max(1, int(edge[1] - edge[0]))
        kernel = np.ones(each) / each
        smooth = np.column_stack([np.convolve(c, kernel, "same") for c in there.T])
        inside = np.convolve(np.ones(len(there)), kernel, "same")
        out: Array = smooth[edge] / inside[edge][:, None]
        return out

    def apart(
        self, t: Array, gyr: Array, scale: Array, edge: Index, attitude: Array
    ) -> Array:
        """Covariance that values elsewhere leave in a closure, (3, 3) rad^2, (1).

        Parameters
        ----------
        t, gyr : (n,) s, (n, 3) rad/s samples of the turn
        scale : (3,) of the gyroscopes
        edge, attitude : samples at the m + 1 edges, and the attitude there

        """
        there, out = self._there(gyr), np.zeros((3, 3))
        gap = float(t[-1] - t[0]) / max(1, len(t) - 1)
        for c in np.flatnonzero(self.step > 0):
            bound = np.flatnonzero(np.diff(gyr[:, c]) != 0) + 1
            first, last = np.append(0, bound), np.append(bound, len(gyr))
            length = (last - first) * gap / scale[c]
            part = length**2 * _lasting(gyr[first, c], length)  # (1)
            middle = (first + last) // 2
            near = np.clip(np.searchsorted(edge, middle), 0, len(edge) - 1)
            axis = attitude[near, c]  # R^T e_c
            part = self.variance[c] * np.where(there[first, c], 0.0, part)
            out += np.einsum("r,ri,rj->ij", part, axis, axis)
        return out

    def _there(self, gyr: Array) -> NDArray[np.bool_]:
        """Where outputs (n, 3) are those of the windows."""
        found: NDArray[np.bool_] = np.abs(gyr - self.value) < NEXT * self.step
        return found


def _lasting(value: Array, length: Array) -> Array:
    """Factor c of (1) of runs on some values (r,) that last so long, (r,)."""
    out = np.ones(len(value))
    before, after = np.diff(value)[:-1], np.diff(value)[1:]
    faster = length[1:-1] * (1 / length[2:] - 1 / length[:-2])
    out[1:-1] = np.where(before * after > 0, np.minimum(faster**2 / 12, 1.0), 1.0)
    return out


def standing(
    block: Block, windows: NDArray[np.intp], alike: Array
) -> StandingOutputs | None:
    """Where gyroscopes stand in windows; None if none of them does.

    `alike` (3,) rad/s is what the errors of all windows have in common.
    """
    if not alike.any() or not len(windows):
        return None
    means = [block.gyr[a:b].mean(axis=0) for a, b in windows.tolist() if b > a]
    step = np.where(alike > 0, steps_in(block, windows)[1], 0.0)
    variance = np.mean(rounding(block, windows)[:, 3:] ** 2, axis=0)
    return StandingOutputs(np.nanmedian(means, axis=0), step, variance)
