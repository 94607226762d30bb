"""One of two recordings that are compared, with its diagnosis.

Gravity is the same for both, so its uncertainty is left out: it affects the scale
factors of both alike. The [model] of session.toml belongs to another simulation and is
ignored. Outputs without noise, as simulators have them, are given white noise of a part
of the other recording's: repeated values are no fault there, and nothing needs to be
known better than the other recording can show.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.core.sampling import sampling_rate
from fieldcal.diagnosis import Diagnosis
from fieldcal.diagnosis.explain import Explanation, explain
from fieldcal.diagnosis.prepare import PreparedRecording, prepare_recording
from fieldcal.diagnosis.verdict import make_diagnosis
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.physics.recording import grids_of
from fieldcal.session.description import Description
from fieldcal.windows.noise import short_lag_noise

MIN_NOISE_RATIO = 0.1
"""Least noise of a simulator's output, relative to the recording's: it adds a hundredth
to the variance of a difference."""

SEED = 1
"""Seed of the added noise, so that the same files give the same result."""


@dataclass(frozen=True)
class DiagnosedRecording:
    """A recording with its explanation and diagnosis.

    Attributes
    ----------
    name : name given by the user
    block : its samples as recorded
    explanation, diagnosis : of the samples
    noise : (6,) standard deviation from one sample to the next at rest
    noise_uncertainty : (6,) of the logarithm of `noise`
    steps : (6,) step of the grid that outputs lie on, 0 where they lie on none
    rate_hz : samples a second
    noise_added : channels to which noise was added

    """

    name: str
    block: Block
    explanation: Explanation
    diagnosis: Diagnosis
    noise: Array
    noise_uncertainty: Array
    steps: Array
    rate_hz: float
    noise_added: tuple[int, ...] = ()

    @property
    def start(self) -> float:
        """First instant of the first window, s of device time."""
        return float(self.explanation.rows.span[0, 0])


def diagnose_side(
    name: str,
    block: Block,
    about: Description,
    beside: DiagnosedRecording | None = None,
) -> DiagnosedRecording:
    """Diagnose one of the recordings; a simulator's with the recording as `beside`.

    Raises
    ------
    InputError
        If nothing in it can be used.

    """
    about = replace(about, model={})
    heard, quieted = block, tuple[int, ...]()
    noise, unsure = sample_noise(block, about)
    if beside is not None:
        heard, quieted = _with_least_noise(block, noise, beside.noise)
    prepared = _with_certain_gravity(prepare_recording(heard, about))
    if beside is not None:
        prepared = _from_one_temperature(prepared, beside.explanation.prepared)
    explanation = explain(prepared)
    found = make_diagnosis(heard, explanation)
    steps = grids_of(block)
    return DiagnosedRecording(
        name,
        block,
        explanation,
        found,
        noise,
        unsure,
        steps,
        sampling_rate(block),
        quieted,
    )


def _with_certain_gravity(prepared: PreparedRecording) -> PreparedRecording:
    """The recording with exactly known gravity, since it is the same for both."""
    rows = prepared.rows
    return replace(prepared, rows=replace(rows, x=replace(rows.x, gravity_sigma=0.0)))


def _from_one_temperature(
    prepared: PreparedRecording, other: PreparedRecording
) -> PreparedRecording:
    """The recording with biases at the temperature at which the other one starts."""
    warmth, start = prepared.source.thermometer, other.source.thermometer.start_c
    ahead = warmth.start_c - start
    if not np.isfinite(ahead):
        return prepared
    warmth = replace(warmth, warming=warmth.warming + ahead, start_c=start)
    rows = prepared.rows
    warmer = replace(rows, x=replace(rows.x, warming=rows.x.warming + ahead))
    return replace(
        prepared, source=replace(prepared.source, thermometer=warmth), rows=warmer
    )


def sample_noise(block: Block, about: Description) -> tuple[Array, Array]:
    """Noise from sample to sample in windows, (6,), and its relative uncertainty.

    From n differences of white noise it is sqrt(3 / (4 n)); where windows disagree by
    more, it is their scatter.
    """
    levels, counts = [], []
    for first, last in window_bounds(block, about):
        piece = block[slice(int(first), int(last))].six
        if len(piece) > 1:
            levels.append(short_lag_noise(piece))
            counts.append(np.isfinite(piece).sum(axis=0))
    if not levels:
        return np.full(6, np.nan), np.full(6, np.nan)
    square, many = np.array(levels) ** 2, np.maximum(np.array(counts), 1)
    weight = np.where(np.isfinite(square), many, 0)
    total = np.maximum(weight.sum(axis=0), 1)
    mean = (weight * np.nan_to_num(square)).sum(axis=0) / total
    mean = np.where(weight.any(axis=0), mean, np.nan)
    off = np.where(mean > 0, np.nan_to_num(square) / np.where(mean > 0, mean, 1) - 1, 0)
    among = np.sqrt((weight**2 * off**2).sum(axis=0)) / total / 2
    return np.sqrt(mean), np.maximum(among, np.sqrt(0.75 / total))


def _with_least_noise(
    block: Block, noise: Array, wanted: Array
) -> tuple[Block, tuple[int, ...]]:
    """Add noise to channels that are much quieter than `wanted` (6,).

    Returns the block, and the channels to which noise was added.
    """
    rng, six = np.random.default_rng(SEED), block.six.copy()
    quiet = np.flatnonzero(np.nan_to_num(noise, nan=np.inf) < MIN_NOISE_RATIO * wanted)
    for c in quiet:
        six[:, c] += MIN_NOISE_RATIO * wanted[c] * rng.standard_normal(len(six))
    return block.with_six(six), tuple(quiet.tolist())
