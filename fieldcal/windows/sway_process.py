"""Fits of waves to a stretch of a window, with one spectrum for all outputs.

    y_c = m_c + q_c t + sum_k s_ck (a_ck cos w_k t + b_ck sin w_k t) + noise,
    a, b ~ N(0, v_k),   s = |f0| of accelerometers, w_k of gyroscopes            (1)

at frequencies half a cycle per window apart, and at those of the strongest lines. v_k
and the noise maximise the evidence: a swell is one line, gusts are many. The waves add
a variance to that of m_c by white noise. The drift q_c is that of the biases, which is
small compared to the slope of a wave of less than a period.

Source: MacKay 1992, Tipping 2001.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.windows.sway_waves import PERIODS, SwayWaves

MAX_ROUNDS, MIN_WAVE_POWER = 20, 1.0
"""Steps towards the greatest evidence; and the least power of a wave in some output, in
that output's noise, for it to be kept."""

REFINED_LINES, GRID_PER_CYCLE = 4, 16
"""Lines whose frequencies are refined, and grid points of their search per 1 / T."""

DRIFT = (2e-4, 2e-4, 2e-4, 2e-5, 2e-5, 2e-5)
"""Drift of the biases of a warm device in half a stretch, 1 sigma, m/s^2 and rad/s. A
larger drift counts as part of a slow wave."""

PLANNED_STEP_S, MIN_WAVE_SIZE = 0.25, 1e-15
"""Time step of a planned window, s, and the least size of a wave in it."""

WORSE = 1.5
"""Largest uncertainty of a window on a swaying base, relative to firm ground."""

LADDER = (10, 15, 20, 30, 45, 60, 90, 120, 180, 300, 600)
"""Window lengths that are considered, s."""


def fit_waves(t: Array, y: Array, hz: Array, known: SwayWaves) -> SwayWaves | None:
    """Waves of greatest evidence in cells (m, 6), or (m, 3) of accelerometers alone.

    None where there are none.

    Parameters
    ----------
    t : (m,) s, middles of the cells
    hz : (k,) frequencies
    known : force and times of the stretch; its waves are replaced

    """
    return _WaveProcess(t, y, hz, known).waves()


def wave_frequencies(t: Array, y: Array, hz: Array, near: float) -> Array:
    """Frequencies, Hz, of which those within `near` of a strong line are replaced."""
    return _with_lines(hz, _line_frequencies(t, y, hz), near)


class _WaveProcess:
    """The process (1) of the outputs of one stretch, fitted by its evidence.

    Parameters
    ----------
    t, y : (m,), (m, c) cells
    hz : (k,) frequencies
    known : force and times of the stretch

    """

    def __init__(self, t: Array, y: Array, hz: Array, known: SwayWaves) -> None:
        self.hz, self.count, self.known = hz, len(t), known
        t = t - known.middle
        wave = np.multiply.outer(t, 2 * np.pi * hz)
        mean = np.sinc(hz * known.length)  # of a wave over a cell
        line = t / np.abs(t).max()
        self.table = np.column_stack([np.cos(wave) * mean, np.sin(wave) * mean, line])
        self.free = self.table - self.table.mean(axis=0)
        self.off = y - y.mean(axis=0)
        rate = np.tile(2 * np.pi * hz[:, None], 3)
        size = np.full((len(hz), 3), np.linalg.norm(known.force))
        self.drift = np.array(DRIFT)[: y.shape[1]]
        self.size = np.tile(np.hstack([size, rate])[:, : y.shape[1]], (2, 1))

    def waves(self) -> SwayWaves | None:
        """Waves of greatest evidence; None where there is none beyond noise."""
        gram, pull = self.free.T @ self.free, self.free.T @ self.off
        bent = np.diff(self.off, n=2, axis=0)
        noise = np.maximum((bent**2).mean(axis=0) / 6, 1e-30)
        at, count = np.arange(len(self.hz)), len(self.hz)
        power = (2 / self.count * pull[:-1] / self.size) ** 2
        v = (power[at] + power[at + count]).mean(axis=1) / 2
        for _ in range(MAX_ROUNDS):
            columns = np.concatenate([at, at + count])
            with_drift, half = np.append(columns, 2 * count), len(at)
            wide = np.sqrt(np.tile(v[at], 2))[:, None] * self.size[columns]
            wide = np.vstack([wide, self.drift])
            mean, cov = _posterior(
                gram[np.ix_(with_drift, with_drift)], pull[with_drift], wide, noise
            )
            known = np.clip(1 - np.einsum("ckk->kc", cov) / wide**2, 1e-12, 1.0)
            share = [
                (x[:half] + x[half:]).sum(axis=1)
                for x in ((mean[:-1] / self.size[columns]) ** 2, known[:-1])
            ]
            v[at] = share[0] / share[1]
            rest = self.off - self.free[:, with_drift] @ mean
            spare = np.maximum(self.count - 1 - known.sum(axis=0), 1.0)
            noise = np.maximum((rest**2).sum(axis=0) / spare, 1e-30)
            loud = (
                v[at, None] * self.size[at] ** 2 * self.count / 2
                > MIN_WAVE_POWER * noise
            )
            if not loud.any():
                return None
            kept = loud.any(axis=1)
            rows = np.append(np.tile(kept, 2), True)
            mean, cov = mean[rows], cov[:, rows][:, :, rows]
            at = at[kept]
        mean_of_waves = self.table[
            :, np.concatenate([at, at + count, [2 * count]])
        ].mean(axis=0)
        excess = np.einsum("i,cij,j->c", mean_of_waves, cov, mean_of_waves)
        half = len(at)
        return replace(
            self.known, hz=self.hz[at], cos=mean[:half], sin=mean[half:-1],
            excess_variance=excess, noise=noise,
        )  # fmt: skip


def _posterior(
    gram: Array, pull: Array, wide: Array, noise: Array
) -> tuple[Array, Array]:
    """Amplitudes (k, 6), covariances (6, k, k) for prior deviations `wide` (k, 6)."""
    sizes = wide.T
    scaled = sizes[:, :, None] * gram * sizes[:, None, :] / noise[:, None, None]
    inverse = np.linalg.inv(scaled + np.eye(len(gram)))
    cov = sizes[:, :, None] * inverse * sizes[:, None, :]
    mean: Array = np.einsum("cij,jc->ic", cov, pull) / noise
    return mean, cov


def needed_seconds(waves: SwayWaves) -> float:
    """Seconds that a window needs to be nearly as good as on firm ground.

    With waves of these sizes and unknown phases, no mean has more than `WORSE` times
    its uncertainty by noise, and the window has periods enough to find the frequency.
    """
    measured = np.isfinite(waves.noise)
    power = ((waves.cos**2 + waves.sin**2) / 2)[:, measured]
    for seconds in LADDER:
        if seconds * waves.mean_hz < PERIODS:
            continue
        t = np.arange(0.0, seconds, PLANNED_STEP_S) - seconds / 2
        noise = waves.noise[measured] * waves.length / PLANNED_STEP_S
        wave = np.multiply.outer(t, 2 * np.pi * waves.hz)
        table = np.hstack([np.cos(wave), np.sin(wave)])
        flat = np.linalg.qr(np.column_stack([np.ones(len(t)), t]))[0]
        free = table - flat @ (flat.T @ table)
        wide = np.sqrt(np.tile(power, (2, 1))) + MIN_WAVE_SIZE
        _, cov = _posterior(free.T @ free, np.zeros_like(wide), wide, noise)
        off = table.mean(axis=0)
        left = np.einsum("i,cij,j->c", off, cov, off)
        if (noise / len(t) + left <= WORSE**2 * noise / len(t)).all():
            return float(seconds)
    return float(LADDER[-1])


def _with_lines(hz: Array, lines: Array, near: float) -> Array:
    """Frequencies and lines, without frequencies that nearly coincide with a line."""
    kept: list[float] = []
    for line in lines.tolist():
        if all(abs(line - other) > near for other in kept):
            kept.append(line)
    distant = np.abs(np.subtract.outer(hz, np.array(kept))).min(axis=1) > near
    return np.sort(np.concatenate([hz[distant], kept]))


def _line_frequencies(t: Array, y: Array, hz: Array) -> Array:
    """Frequencies of the strongest lines, (l,) Hz, each in the others' residual."""
    noise = np.maximum(np.diff(y, n=2, axis=0).std(axis=0) / np.sqrt(6), 1e-12)
    white = y / noise
    step = float(hz[1] - hz[0]) / 2 if len(hz) > 1 else float(hz[0]) / 2
    grid = np.arange(hz[0], hz[-1], 2 * step / (GRID_PER_CYCLE / 4))
    frequencies: list[float] = []
    for _ in range(REFINED_LINES):
        rest = without_waves(t, white, frequencies)
        power = np.abs(np.exp(-2j * np.pi * np.outer(grid, t)) @ rest) ** 2
        at = float(grid[int(np.argmax(power.sum(axis=1)))])
        frequencies.append(at)
        for width in step / 2.0 ** np.arange(1, 9):
            for i in range(len(frequencies)):
                near = frequencies[i] + width * np.array([-1.0, 0.0, 1.0])
                others = [*frequencies[:i], *frequencies[i + 1 :]]
                left = [
                    (without_waves(t, white, [*others, f]) ** 2).sum() for f in near
                ]
                frequencies[i] = float(near[int(np.argmin(left))])
    return np.array(frequencies)


def without_waves(t: Array, y: Array, hz: Sequence[float]) -> Array:
    """Outputs (m, c) less a constant, a drift and waves at the frequencies `hz`."""
    wave = np.multiply.outer(t - t.mean(), 2 * np.pi * np.array(hz))
    s = (t - t.mean()) / np.ptp(t)
    design = np.column_stack([np.ones_like(s), s, np.cos(wave), np.sin(wave)])
    base = np.linalg.qr(design)[0]
    rest: Array = y - base @ (base.T @ y)
    return rest
