"""A line in the spectrum: its frequency, its causes, and what it predicts.

Causes c of an effect produce the amplitudes R c of a wave in windows, or in stretches
of them (`moments`). c follows from the measured amplitudes A by least squares, and the
frequency is that at which they explain most. To test the prediction, part of the
windows is left out, causes and frequency are found from the rest, and |A - R c|^2 / 2
of the part left out is the remaining mean square. Source: D. Rife, R. Boorstyn,
Single-tone parameter estimation, 1974.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.diagnosis.signal.moments import Moments, moments_of
from fieldcal.diagnosis.signal.pieces import Complex, WindowSamples
from fieldcal.model import detections, resolutions, thresholds, tolerances
from fieldcal.physics.effect import Line
from fieldcal.physics.experience import Experience


@dataclass(frozen=True, slots=True)
class SpectralLine:
    """A line with its explanation.

    Attributes
    ----------
    effect : hum, sway ...
    hz : frequency
    causes : (m,) complex amplitudes of the effect's causes
    values, sigmas : by parameter name
    channels : outputs in which it is significant
    amplitude : (6,) mean amplitude in the outputs
    chi2 : decrease of the whitened squares
    gain : rise of ln Z, for a prior as wide as the causes are large

    """

    effect: Line
    hz: float
    causes: Complex
    values: dict[str, float]
    sigmas: dict[str, float]
    channels: tuple[str, ...]
    amplitude: Array
    chi2: float
    gain: float

    def amplitudes(self, x: Experience) -> Complex:
        """Its complex amplitudes in windows of these orientations, (w, 6)."""
        return self.effect.response(x, self.hz) @ self.causes

    @property
    def clear_channels(self) -> list[int]:
        """Indices of the channels in which it is significant."""
        return [CHANNELS.index(name) for name in self.channels]


@dataclass(frozen=True, slots=True)
class LineRemainder:
    """Mean squares of the outputs at the frequency of a line, (6,) each.

    Attributes
    ----------
    before : as recorded
    after : less the line
    held_out : less what the rest of the recording predicts of it
    predictive_score : decrease of the whitened squares by that prediction

    """

    before: Array
    after: Array
    held_out: Array
    predictive_score: Array

    def gain(self, clear: list[int]) -> float:
        """Part of the held-out rms that it removes, in the channel with most effect."""
        most = clear[int(np.argmax(self.predictive_score[clear]))]
        return float(1 - np.sqrt(self.held_out[most] / self.before[most]))


def tune_line(pieces: WindowSamples, effect: Line, moments: Moments) -> SpectralLine:
    """Fit an effect at the frequency near that of the moments that explains most."""
    shortest = pieces.shortest_samples(resolutions.PERIODOGRAM_SAMPLES) / pieces.rate
    step = 0.2 / max(float(np.ptp(moments.middle)), shortest)
    offsets = np.arange(-1.5 / shortest, 1.5 / shortest + step, step)
    tone = _line_at_best_frequency(pieces, effect, moments, offsets, step, 3)
    if not pieces.usable or tone.hz * shortest > detections.SLOPE_PERIODS:
        return tone
    whole = pieces.with_whole_line(tone.hz, tone.amplitudes(pieces.x))
    again = moments_of(whole, tone.hz)
    return _line_at_best_frequency(
        pieces, effect, again, np.linspace(-step, step, 11), step / 5, 2
    )


def measured_amplitudes(
    pieces: WindowSamples, effect: Line, hz: float
) -> tuple[dict[str, float], dict[str, float]]:
    """Amplitudes of an effect at one frequency, those within the noise among them.

    Returns
    -------
    values, sigmas : by parameter name

    """
    at, here = np.zeros(1), moments_of(pieces, hz)
    causes, sigma, _ = _fit_causes(pieces, effect, here, at, least=0.0)
    if pieces.usable:
        amplitude = effect.response(pieces.x, hz) @ causes[0]
        again = moments_of(pieces.with_whole_line(hz, amplitude), hz)
        causes, sigma, _ = _fit_causes(pieces, effect, again, at, least=0.0)
    return _named_amplitudes(effect, causes[0], sigma[0])


def line_remainder(pieces: WindowSamples, tone: SpectralLine) -> LineRemainder:
    """Mean squares that are left of a line, after its fit and after its prediction."""
    many = len(pieces.samples) >= thresholds.MIN_ALIKE
    moments = moments_of(
        pieces, tone.hz, 1 if many else resolutions.LINE_STRETCHES_PER_WINDOW
    )
    groups = np.arange(len(moments.counts))
    fold = groups % (
        tolerances.MAX_FOLDS if many else resolutions.LINE_STRETCHES_PER_WINDOW
    )
    measured = moments.amplitudes(np.zeros(1))[0]
    fitted = tone.amplitudes(pieces.x)[moments.window]
    ahead = measured.copy()
    span = max(float(np.ptp(moments.middle)), 1 / tone.hz)
    for i in np.unique(fold):
        rest = moments.select(fold != i)
        step = 0.2 / span
        near = _line_at_best_frequency(
            pieces, tone.effect, rest, np.array([-step, 0, step]), step, 2
        )
        # a wave at a slightly different frequency rotates against that at tone.hz
        left = moments.select(fold == i)
        predicted = near.amplitudes(pieces.x)[left.window]
        ahead[fold == i] -= predicted * _mean_rotation(left, near.hz - tone.hz)
    noise = np.where(np.nan_to_num(pieces.noise) > 0, pieces.noise, np.inf)
    fallen = np.abs(measured) ** 2 - np.abs(ahead) ** 2
    return LineRemainder(
        _mean_square(measured),
        _mean_square(measured - fitted),
        _mean_square(ahead),
        moments.counts / 2 @ fallen / noise**2,
    )


def _mean_rotation(moments: Moments, offset: float) -> Complex:
    """Mean of exp(2 pi i offset t) over each group, (g, 1)."""
    turned = np.exp(2j * np.pi * offset * moments.middle)
    mean: Complex = np.add.reduceat(turned, moments.bound[:-1]).astype(complex)
    return (mean / np.diff(moments.bound))[:, None]


def _mean_square(amplitude: Complex) -> Array:
    square: Array = (np.abs(amplitude) ** 2 / 2).mean(axis=0)
    return square


def _line_at_best_frequency(
    pieces: WindowSamples,
    effect: Line,
    moments: Moments,
    offsets: Array,
    step: float,
    rounds: int,
) -> SpectralLine:
    for _ in range(rounds):
        some = np.array_split(
            offsets, -(-len(offsets) // tolerances.FREQUENCIES_AT_ONCE)
        )
        chi2 = np.concatenate(
            [_fit_causes(pieces, effect, moments, each)[2] for each in some]
        )
        near = _parabola_peak(offsets, chi2)
        offsets = near + np.linspace(-step, step, 11)
        step /= 5
    return _line_at(pieces, effect, moments, near)


def _parabola_peak(offsets: Array, chi2: Array) -> float:
    """Position of the maximum of evenly spaced values, by a parabola through three."""
    top = int(np.argmax(chi2))
    if not 0 < top < len(chi2) - 1:
        return float(offsets[top])
    below, highest, above = chi2[top - 1 : top + 2]
    bend = max(2 * highest - below - above, 1e-300)
    return float(offsets[top] + (offsets[1] - offsets[0]) * (above - below) / 2 / bend)


def _fit_causes(
    pieces: WindowSamples,
    effect: Line,
    moments: Moments,
    offset: Array,
    least: float = thresholds.LINE_SIGMAS,
) -> tuple[Complex, Array, Array]:
    """Fit the causes of an effect at slightly different frequencies, `offset` (o,) Hz.

    Causes of single outputs below `least` standard deviations are dropped.

    Returns
    -------
    causes : (o, m)
    sigma : (o, m) their standard deviation
    chi2 : (o,) decrease of the whitened squares

    """
    count, size = len(offset), 6 * len(moments.counts)
    measured = moments.amplitudes(offset).reshape(count, size, 1)
    each = [effect.response(pieces.x, hz) for hz in moments.near + offset]
    response = np.array(each)[:, moments.window].reshape(count, size, -1)
    # a channel that never changes has no weight
    heard = np.nan_to_num(pieces.noise) > 0
    weight = np.where(heard, 1 / np.where(heard, pieces.noise, 1.0) ** 2, 0.0)
    weight = np.outer(moments.counts / 2, weight).ravel()
    weighted = np.conj(np.swapaxes(response, 1, 2)) * weight
    normal = weighted @ response
    trace = np.trace(normal, axis1=1, axis2=2).real[:, None, None]
    normal += 1e-12 * trace * np.eye(normal.shape[-1])
    causes = np.linalg.solve(normal, weighted @ measured)[..., 0]
    own = np.diagonal(np.linalg.inv(normal), axis1=1, axis2=2)
    sigma = np.sqrt(own.real)
    if effect.kind == "sensor":  # each output has its own cause: drop those at noise
        causes = np.where(np.abs(causes) > least * sigma, causes, 0.0)
    left = measured - response @ causes[..., None]
    fallen = np.abs(measured) ** 2 - np.abs(left) ** 2
    return causes, sigma, fallen[..., 0] @ weight


def _line_at(
    pieces: WindowSamples, effect: Line, moments: Moments, offset: float
) -> SpectralLine:
    """The line at one frequency, with its amplitudes and what it explains."""
    hz = moments.near + offset
    found = _fit_causes(pieces, effect, moments, np.array([offset]))
    causes, sigma, chi2 = found[0][0], found[1][0], float(found[2][0])
    response = effect.response(pieces.x, hz)[moments.window]
    strength = np.abs(causes / sigma) ** 2
    amplitude = np.sqrt((np.abs(response @ causes) ** 2).mean(axis=0))
    error = pieces.noise * np.sqrt(2 / moments.counts.sum())
    clear = [
        c
        for c, a, e in zip(CHANNELS, amplitude, error, strict=True)
        if a > thresholds.LINE_SIGMAS * e
    ]
    values, sigmas = _named_amplitudes(effect, causes, sigma)
    values["hz"] = float(hz)
    spread = float(np.concatenate(pieces.times).std())
    sigmas["hz"] = float(1 / (2 * np.pi * spread * np.sqrt(max(chi2, 1.0))))
    return SpectralLine(
        effect, float(hz), causes, values, sigmas, tuple(clear), amplitude, chi2,
        chi2 / 2 - float(np.log1p(strength / 2).sum()),
    )  # fmt: skip


def _named_amplitudes(
    effect: Line, causes: Complex, sigma: Array
) -> tuple[dict[str, float], dict[str, float]]:
    """Amplitudes by name: one for each cause, or one for all of them."""
    names = [p.name for p in effect.params]
    if len(names) == len(causes):
        nonzero = np.flatnonzero(causes)
        return (
            {names[i]: float(abs(causes[i])) for i in nonzero},
            {names[i]: float(sigma[i]) for i in nonzero},
        )
    size = float(np.linalg.norm(causes))
    share = np.abs(causes) / max(size, 1e-300)
    return {names[0]: size}, {names[0]: float(np.linalg.norm(share * sigma))}
