"""Noise of the outputs of a recording inside windows (`fieldcal.windows.noise`)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.core.once import once_per_block
from fieldcal.core.samples import Array, Block, Index
from fieldcal.model.rows.block_means import mean_of_known
from fieldcal.physics.grid_stretches import grids_by_stretch
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
    """Standard deviation of rounding alone in each window, from the least change.

    (w, 6) for the w windows that hold a sample.
    """
    return least_deviation(quantisation_steps(block, windows))


def rounding_sigma(block: Block, windows: Index) -> Array:
    """Standard deviation of each window's mean by rounding of the outputs, (w, 6)."""
    steps = quantisation_steps(block, windows)
    differences = np.concatenate(
        [
            np.nan_to_num([short_lag_noise(piece[:STEP_SAMPLES]) for piece in pieces])
            for pieces in _pieces(block, windows)
        ],
        axis=1,
    )
    deviation: Array = np.sqrt(
        np.maximum(
            variance_of_mean(steps, differences),
            variance_of_few_values(steps, differences),
        )
    )
    return deviation


def shared_rounding_sigma(block: Block, windows: Index, off: Array) -> Array:
    """Part of the errors `off` (w, 6) of `rounding_sigma` that all windows share, (6,).

    A gyroscope at rest measures the same in each window. Its rounding error is the same
    if its noise is smaller than a step.
    """
    out = np.zeros(6)
    step = quantisation_steps(block, windows)[:, 3:].max(axis=0, initial=0.0)
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


@once_per_block
def quantisation_steps(block: Block, windows: Index) -> Array:
    """Quantisation step of each output in each window that holds a sample, (w, 6).

    Those of outputs that are constant in all windows are found in the whole recording,
    and those of outputs whose grid changes in the stretches.
    """
    held = np.concatenate([smallest_steps(p) for p in _pieces(block, windows)])
    if not (held > 0).all():
        held = np.where(held > 0, held, grids_of(block))
    steps = [held.copy() for a, b in windows if b > a] or [held]
    grids = grids_by_stretch(block)
    for step, (a, b) in zip(steps, (w for w in windows if w[1] > w[0]), strict=False):
        step[grids.changed] = grids.within(a, b)[grids.changed]
    found = np.array(steps)
    found.setflags(write=False)
    return found


def _pieces(block: Block, windows: Index) -> Iterator[list[Array]]:
    """Samples of each window, of the accelerometers and of the gyroscopes."""
    held = [slice(a, b) for a, b in windows if b > a]
    for triad in (block.acc, block.gyr):
        yield [triad[w] for w in held] or [triad[:0]]
