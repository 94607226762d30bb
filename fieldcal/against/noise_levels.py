"""Differences in the noise of samples.

An output that lies on a grid of step q scatters by q^2 / 12 more, as a variance, in the
mean over where the output lies between two steps, and by about half of that more or
less, as it lies. Where the scatter is no larger than that, the noise is not told.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.against.joint import probability_of_difference
from fieldcal.against.result import Difference, RealAndSimulated
from fieldcal.against.side import DiagnosedRecording
from fieldcal.core.samples import CHANNELS, Array
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
    one, two = _noise_alone(real)[0], _noise_alone(sim)[0]
    told = np.flatnonzero((one > 0) & np.isfinite(two))
    for triad in ((0, 1, 2), (3, 4, 5)):
        if at := [c for c in told.tolist() if c in triad]:
            yield from _triad_noise_difference(real, sim, at)


def _noise_alone(side: DiagnosedRecording) -> tuple[Array, Array]:
    """Noise of each channel without rounding, (6,), and the sigma of its logarithm.

    nan where rounding hides it.
    """
    variance = side.noise**2 - side.steps**2 / 12
    told = (variance > 0) | (side.noise == 0)
    level = np.sqrt(np.where(told, np.maximum(variance, 0.0), np.nan))
    rounding = np.zeros(6)
    np.divide(side.steps**2 / 24, level**2, out=rounding, where=level > 0)
    return level, np.hypot(side.noise_uncertainty, rounding)


def _triad_noise_difference(
    real: DiagnosedRecording, sim: DiagnosedRecording, at: Sequence[int]
) -> Iterator[Difference]:
    """Difference of one triad, by the logarithms of its noise levels."""
    (one, unsure), (two, other_unsure) = _noise_alone(real), _noise_alone(sim)
    one, two = one[at], np.maximum(two[at], NO_NOISE_RATIO * one[at])
    off, sigma = np.log(one / two), np.hypot(unsure[at], other_unsure[at])
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
