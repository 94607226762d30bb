"""Noise of the outputs of a recording inside windows (`fieldcal.windows.noise`)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.core.samples import Array, Block, Index
from fieldcal.model.rows.block_means import mean_of_known
from fieldcal.physics.recording import grids_of
from fieldcal.windows import noise
from fieldcal.windows.noise import (
    STEP_SAMPLES,
    ChannelNoise,
    short_lag_noise,
    smallest_steps,
)
from fieldcal.windows.rounding import (
    covariance_of_two_means,
    least_deviation,
    variance_of_few_values,
    variance_of_mean,
)


def noise_of(block: Block, windows: Index, rate_hz: float) -> ChannelNoise:
    """Noise of one sample of each output inside windows, (6,)."""
    acc, gyr = (noise.measure_noise(p, rate_hz) for p in _pieces(block, windows))
    return ChannelNoise(
        np.concatenate([acc.white, gyr.white]), np.concatenate([acc.quick, gyr.quick])
    )


def rounding_noise(block: Block, windows: Index) -> Array:
    """Standard deviation of rounding alone, from the least change, (6,)."""
    return least_deviation(np.concatenate(quantisation_steps(block, windows)))


def rounding_sigma(block: Block, windows: Index) -> Array:
    """Standard deviation of each window's mean by rounding of the outputs, (w, 6)."""
    off = []
    steps = quantisation_steps(block, windows)
    for step, pieces in zip(steps, _pieces(block, windows), strict=True):
        differences = np.nan_to_num(
            [short_lag_noise(piece[:STEP_SAMPLES]) for piece in pieces]
        )
        few = variance_of_few_values(step, differences)
        off.append(np.maximum(variance_of_mean(step, differences), few))
    deviation: Array = np.sqrt(np.concatenate(off, axis=1))
    return deviation


def shared_rounding_sigma(block: Block, windows: Index, off: Array) -> Array:
    """Part of the errors `off` (w, 6) of `rounding_sigma` that all windows share, (6,).

    A gyroscope at rest measures the same in each window. Its rounding error is the same
    if its noise is smaller than a step.
    """
    out = np.zeros(6)
    step = quantisation_steps(block, windows)[1]
    _, pieces = _pieces(block, windows)
    mean = np.array([mean_of_known(piece) for piece in pieces])
    sampled = np.nan_to_num([short_lag_noise(piece[:STEP_SAMPLES]) for piece in pieces])
    pairs = np.triu_indices(len(pieces), 1)
    for c in np.flatnonzero(step > 0):
        apart = mean[pairs[0], c] - mean[pairs[1], c]
        apart = apart[np.isfinite(apart)]
        usual = float(np.median(sampled[:, c]))
        *shared, own = covariance_of_two_means(step[c], usual, np.append(apart, 0.0))
        if len(shared) and own > 0:
            share = max(float(np.mean(shared)) / own, 0.0)
            out[3 + c] = np.sqrt(share * np.mean(off[:, 3 + c] ** 2))
    return out


def quantisation_steps(block: Block, windows: Index) -> tuple[Array, Array]:
    """Quantisation steps of both triads, (3,) each.

    Those of outputs that are constant in all windows are found in the whole recording.
    """
    held = np.concatenate([smallest_steps(p) for p in _pieces(block, windows)])
    if not (held > 0).all():
        held = np.where(held > 0, held, grids_of(block))
    return held[:3], held[3:]


def _pieces(block: Block, windows: Index) -> Iterator[list[Array]]:
    """Samples of each window, of the accelerometers and of the gyroscopes."""
    held = [slice(a, b) for a, b in windows if b > a]
    for triad in (block.acc, block.gyr):
        yield [triad[w] for w in held] or [triad[:0]]
