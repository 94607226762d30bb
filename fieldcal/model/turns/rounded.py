"""Rounding during a turn: gyroscope outputs that keep one value.

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

An output with a dead band (`windows.dead_band`) is off by what the windows are off by
as long as it is near the band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block, Index
from fieldcal.model.rows.noise import quantisation_steps, rounding_sigma
from fieldcal.windows.dead_band import dead_bands

MAX_STEP_PART = 0.99
"""Part of a step: a mean between two values is less than one from both."""


@dataclass(frozen=True, slots=True)
class StandingOutputs:
    """Values that the gyroscopes keep in the windows, rounded or in a dead band.

    Attributes
    ----------
    value, step : (3,) rad/s; outputs nearer than a step are those of the windows; the
        step is 0 if noise exceeds it
    variance : (3,) of the error of a constant output, (rad/s)^2

    """

    value: Array
    step: Array
    variance: Array

    def share(self, gyr: Array, edge: Index) -> Array:
        """Share of time about each edge with the windows' values, (m + 1, 3).

        `gyr` (n, 3) are the outputs, `edge` the samples at the edges.
        """
        at_value = self._there(gyr).astype(float)
        each = max(1, int(edge[1] - edge[0]))
        kernel = np.ones(each) / each
        smooth = np.column_stack([np.convolve(c, kernel, "same") for c in at_value.T])
        inside = np.convolve(np.ones(len(at_value)), kernel, "same")
        out: Array = smooth[edge] / inside[edge][:, None]
        return out

    def closure_covariance(
        self, t: Array, gyr: Array, scale: Array, edge: Index, attitude: Array
    ) -> Array:
        """Covariance of a closure from rounding at other values, (3, 3) rad^2, (1).

        Parameters
        ----------
        t, gyr : (n,) s, (n, 3) rad/s samples of the turn
        scale : (3,) of the gyroscopes
        edge, attitude : samples at the m + 1 edges, and the attitude there

        """
        at_value, out = self._there(gyr), np.zeros((3, 3))
        gap = float(t[-1] - t[0]) / max(1, len(t) - 1)
        for c in np.flatnonzero(self.step > 0):
            bound = np.flatnonzero(np.diff(gyr[:, c]) != 0) + 1
            first, last = np.append(0, bound), np.append(bound, len(gyr))
            length = (last - first) * gap / scale[c]
            part = length**2 * _run_factor(gyr[first, c], length)  # (1)
            middle = (first + last) // 2
            near = np.clip(np.searchsorted(edge, middle), 0, len(edge) - 1)
            axis = attitude[near, c]  # R^T e_c
            part = self.variance[c] * np.where(at_value[first, c], 0.0, part)
            out += np.einsum("r,ri,rj->ij", part, axis, axis)
        return out

    def _there(self, gyr: Array) -> NDArray[np.bool_]:
        """Samples whose outputs (n, 3) are those of the windows."""
        found: NDArray[np.bool_] = np.abs(gyr - self.value) < MAX_STEP_PART * self.step
        return found


def _run_factor(value: Array, length: Array) -> Array:
    """Factor c of (1), (r,), for runs on values (r,) with their lengths (r,)."""
    out = np.ones(len(value))
    before, after = np.diff(value)[:-1], np.diff(value)[1:]
    faster = length[1:-1] * (1 / length[2:] - 1 / length[:-2])
    out[1:-1] = np.where(before * after > 0, np.minimum(faster**2 / 12, 1.0), 1.0)
    return out


def find_standing_outputs(
    block: Block, windows: NDArray[np.intp], alike: Array
) -> StandingOutputs | None:
    """Values of gyroscopes in windows; None if no output keeps its value.

    `alike` (3,) rad/s is the part of the errors that all windows share.
    """
    if not alike.any() or not len(windows):
        return None
    means = [block.gyr[a:b].mean(axis=0) for a, b in windows.tolist() if b > a]
    step = np.where(alike > 0, quantisation_steps(block, windows)[1], 0.0)
    variance = np.mean(rounding_sigma(block, windows)[:, 3:] ** 2, axis=0)
    band = np.where(alike > 0, dead_bands(block)[3:], 0.0)
    return StandingOutputs(
        np.where(band > 0, 0.0, np.nanmedian(means, axis=0)),
        np.where(band > 0, 2 * band, step),
        np.where(band > 0, 0.0, variance),
    )
