"""Rounding during a turn: gyroscope outputs that keep one value.

Outputs are rounded to a grid of steps q, rad/s. While an output changes from sample to
sample, its rounding error differs in each sample and averages out. While an output
keeps one value U, its error is constant, anywhere within a step.

If U is also the value in the windows, the error is the one that the windows share. Its
columns then act on the turn, weighted by the share of time at U. For every other run of
n samples on one value, between neighbouring runs of m and k samples,

    var of its part of the closure = (n dt / s)^2 q^2 / 12 * c                      (1)

with dt the time between samples, s the scale factor, and c = 1 if the rate returns to
the value before. If the rate continues in the same direction, it crosses the whole
step: its error is symmetric about zero except where the rate accelerates. The mean
error is then q / 12 (n / k - n / m), and c the square of this bracket over 12. Noise
that reaches across a step reduces the variance ((2) of `windows.rounding`).

An output with a dead band (`windows.dead_band`) has the error that the windows share
as long as it is near the band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Block, Index, Mask
from fieldcal.model import detections
from fieldcal.model.rows.noise import quantisation_steps, rounding_sigma
from fieldcal.windows.dead_band import dead_bands


@dataclass(frozen=True, slots=True)
class StandingOutputs:
    """Values that the gyroscopes keep in the windows, rounded or in a dead band.

    Attributes
    ----------
    value : (3,) rad/s, output in the windows; 0 with a dead band
    step : (3,) rad/s, step of the grid, or twice the dead band; outputs nearer to
        `value` than this count as those of the windows; 0 if noise exceeds the step
    variance : (3,) (rad/s)^2, variance of the error of a constant output

    """

    value: Array
    step: Array
    variance: Array

    def share(self, gyr: Array, edge: Index) -> Array:
        """Share of time about each edge with the windows' values, (m + 1, 3).

        `gyr` (n, 3) are the outputs during the turn, rad/s, and `edge` (m + 1,) the
        samples at the edges.
        """
        at_value = self._at_window_value(gyr).astype(float)
        step_samples = max(1, int(edge[1] - edge[0]))
        kernel = np.ones(step_samples) / step_samples
        smooth = np.column_stack([np.convolve(c, kernel, "same") for c in at_value.T])
        inside = np.convolve(np.ones(len(at_value)), kernel, "same")
        return smooth[edge] / inside[edge][:, None]

    def closure_covariance(
        self, t: Array, gyr: Array, scale: Array, edge: Index, attitude: Array
    ) -> Array:
        """Covariance (3, 3) rad^2 of a closure from rounding, (1).

        Runs on the value of the windows are left out: their error is in `share`.

        Parameters
        ----------
        t, gyr : (n,) s, (n, 3) rad/s samples of the turn
        scale : (3,) of the gyroscopes
        edge, attitude : samples at the m + 1 edges, and the attitude there

        """
        at_value, out = self._at_window_value(gyr), np.zeros((3, 3))
        gap = float(t[-1] - t[0]) / max(1, len(t) - 1)
        for c in np.flatnonzero(self.step > 0):
            bound = np.flatnonzero(np.diff(gyr[:, c]) != 0) + 1
            first, last = np.append(0, bound), np.append(bound, len(gyr))  # of runs
            length = (last - first) * gap / scale[c]
            factor = length**2 * _run_factor(gyr[first, c], length)  # (1)
            middle = (first + last) // 2
            near = np.clip(np.searchsorted(edge, middle), 0, len(edge) - 1)
            axis = attitude[near, c]  # R^T e_c
            variance = self.variance[c] * np.where(at_value[first, c], 0.0, factor)
            out += np.einsum("r,ri,rj->ij", variance, axis, axis)
        return out

    def _at_window_value(self, gyr: Array) -> Mask:
        """Whether each output (n, 3) has the value of the windows, (n, 3)."""
        return np.abs(gyr - self.value) < detections.MAX_STEP_PART * self.step


def _run_factor(value: Array, length: Array) -> Array:
    """Factor c of (1), (r,), of runs with values and lengths (r,) in order of time."""
    out = np.ones(len(value))
    before, after = np.diff(value)[:-1], np.diff(value)[1:]
    faster = length[1:-1] * (1 / length[2:] - 1 / length[:-2])
    out[1:-1] = np.where(before * after > 0, np.minimum(faster**2 / 12, 1.0), 1.0)
    return out


def find_standing_outputs(
    block: Block, windows: Index, shared_error: Array
) -> StandingOutputs | None:
    """Values of the gyroscopes in the windows; None if no output keeps its value.

    Parameters
    ----------
    block : samples of the recording
    windows : (p, 2) first and end sample of each window
    shared_error : (3,) rad/s, standard deviation of the error that all windows share

    """
    if not shared_error.any() or not len(windows):
        return None
    means = [block.gyr[a:b].mean(axis=0) for a, b in windows.tolist() if b > a]
    coarsest = quantisation_steps(block, windows).max(axis=0)
    step = np.where(shared_error > 0, coarsest[3:], 0.0)
    variance = np.mean(rounding_sigma(block, windows)[:, 3:] ** 2, axis=0)
    band = np.where(shared_error > 0, dead_bands(block)[3:], 0.0)
    return StandingOutputs(
        np.where(band > 0, 0.0, np.nanmedian(means, axis=0)),
        np.where(band > 0, 2 * band, step),
        np.where(band > 0, 0.0, variance),
    )
