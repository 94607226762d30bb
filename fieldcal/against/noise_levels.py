"""Differences in the noise of samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.against.joint import probability_of_difference
from fieldcal.against.result import Difference, RealAndSimulated
from fieldcal.against.side import DiagnosedRecording
from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.findings.agreement import UNITS
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.model import thresholds

NOISE_LOG_SPREAD = 0.5
"""Typical difference of the noise of two devices, ln."""

NO_NOISE_RATIO = 1e-3
"""Noise, relative to the other recording's, that counts as none."""


def noise_level(one: DiagnosedRecording, c: int) -> Quantity:
    """Noise of one channel."""
    level = float(one.noise[c])
    return Quantity(level, level * float(one.noise_uncertainty[c]), UNITS[c // 3])


def noise_differences(
    real: DiagnosedRecording, sim: DiagnosedRecording
) -> Iterator[Difference]:
    """Differences in the noise of each triad."""
    for part in (slice(0, 3), slice(3, 6)):
        seen = np.isfinite(real.noise[part]) & np.isfinite(sim.noise[part])
        at = np.flatnonzero(seen & (real.noise[part] > 0)) + part.start
        if len(at):
            yield from _triad_noise_difference(real, sim, at.tolist())


def _triad_noise_difference(
    real: DiagnosedRecording, sim: DiagnosedRecording, at: Sequence[int]
) -> Iterator[Difference]:
    """Difference of one triad, by the logarithms of its noise levels."""
    one = real.noise[at]
    two = np.maximum(sim.noise[at], NO_NOISE_RATIO * one)
    off = np.log(one / two)
    sigma = np.hypot(real.noise_uncertainty[at], sim.noise_uncertainty[at])
    probability = probability_of_difference(
        off, np.diag(sigma**2), np.full(len(at), NOISE_LOG_SPREAD)
    )
    if probability < thresholds.NAMED:
        return
    pairs = {
        CHANNELS[c]: RealAndSimulated.of(noise_level(real, c), noise_level(sim, c))
        for c in at
    }
    silent = bool((sim.noise[at] <= NO_NOISE_RATIO * one).all())
    louder = [
        c
        for c, o, s in zip(at, off, sigma, strict=True)
        if abs(o) > thresholds.STANDS_OUT * s
    ]
    where = tuple(
        _mismatch_of_channel(real, CHANNELS[c], pairs[CHANNELS[c]]) for c in louder
    )
    yield Difference(
        "noise", "left_out" if silent else "resized", probability, pairs, where=where
    )


def _mismatch_of_channel(
    one: DiagnosedRecording, channel: str, pair: RealAndSimulated
) -> Mismatch:
    """The mismatch of a channel in all samples."""
    positions = one.explanation.prepared.source.about.position_numbers or (0,)
    off = pair.difference
    size = abs(float(off.value))
    return Mismatch(
        channel=channel,
        kind="samples",
        positions=tuple(sorted(positions)),
        from_s=float(one.block.t[0]),
        to_s=float(one.block.t[-1]),
        covariate="noise",
        rms=size,
        sigma=size / off.sigma if off.sigma else np.inf,
    )
