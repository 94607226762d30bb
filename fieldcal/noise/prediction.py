"""The Allan deviation that another recording of the device will have.

A band includes the uncertainty of the processes (their sizes, and which of them, by the
weights of `terms`), and the scatter of an estimate from a recording of that length. The
sizes are drawn from their density with the reference prior (`reference`): drawn from
the normal distribution about its maximum, weighted by the density, and drawn again
(Rubin 1987).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import NoiseFit, parameter_bounds
from fieldcal.noise.processes import (
    DIFFERENCES_PER_TIME,
    UNCORRELATED_TIMES,
    allan_variance,
    degrees_of_freedom,
    difference_covariances,
)
from fieldcal.noise.reference import SizeDensity
from fieldcal.noise.spectrum import CosineSpectrum
from fieldcal.noise.terms import ChosenProcesses

DRAWS = 200
SHAPES = 8
WIDER = 1.3
"""Factor that widens the distribution that is drawn from, to cover the tails."""

MAX_LOG_DISTANCE = 3.0
"""Largest distance of a drawn logarithm from the maximum."""


@dataclass(frozen=True, slots=True)
class SizeDraw:
    """One draw of the sizes of processes."""

    terms: tuple[str, ...]
    x: Array


@dataclass(frozen=True, slots=True)
class DeviationBand:
    """Predicted Allan deviation of another recording.

    Attributes
    ----------
    tau : (t,) s
    median, low, high : (t,) deviation, and its 68 % interval
    variance, freedom : (t, d) Allan variance of each draw, and the degrees of freedom
        of its estimate

    """

    tau: Array
    median: Array
    low: Array
    high: Array
    variance: Array
    freedom: Array

    def log_score(self, deviation: Array) -> Array:
        """Log density of the logarithm of measured deviations (t,), natural units."""
        from scipy.special import gammaln, logsumexp

        half = self.freedom / 2
        ratio = np.log(deviation**2)[:, None] - np.log(self.variance)
        each = (
            np.log(2) + half * np.log(half) - gammaln(half)
            + half * (ratio - np.exp(ratio))
        )  # fmt: skip
        found: Array = logsumexp(each, axis=1) - np.log(each.shape[1])
        return found


def draw_sizes(
    spectrum: CosineSpectrum, chosen: ChosenProcesses, seed: int = 0
) -> list[SizeDraw]:
    """Draw sizes of the processes of a channel from their probability density."""
    rng = np.random.default_rng(seed)
    out: list[SizeDraw] = []
    for weight, one in chosen.weighted_fits:
        number = round(weight * DRAWS)
        if number:
            out += _draws_of_fit(spectrum, chosen, one, number, rng)
    return out


def _draws_of_fit(
    spectrum: CosineSpectrum,
    chosen: ChosenProcesses,
    one: NoiseFit,
    number: int,
    rng: np.random.Generator,
) -> list[SizeDraw]:
    values, axes = np.linalg.eigh(one.covariance)
    spread = WIDER * axes * np.sqrt(np.maximum(values, 0.0))
    standard = rng.standard_normal((2 * number, len(one.x)))
    steps = np.clip(standard @ spread.T, -MAX_LOG_DISTANCE, MAX_LOG_DISTANCE)
    tried = np.clip(one.x + steps, *parameter_bounds(spectrum, one.terms))
    weights = _density(spectrum, chosen, one, tried)
    weights += 0.5 * np.sum(standard**2, axis=1)
    chance = np.exp(weights - weights.max())
    picked = rng.choice(len(tried), number, p=chance / chance.sum())
    return [SizeDraw(one.terms, tried[i]) for i in picked]


def _density(
    spectrum: CosineSpectrum, chosen: ChosenProcesses, one: NoiseFit, tried: Array
) -> Array:
    """Log density (d,) of sizes and times (d, p)."""
    sizes = tried[:, : len(one.terms)]
    if not one.timed:
        of = SizeDensity.of(spectrum, chosen.powers, one.terms, one.x)
        return of.log_density(sizes)
    each = [
        SizeDensity.of(spectrum, chosen.powers, one.terms, x).log_density(
            x[None, : len(one.terms)]
        )
        for x in tried
    ]
    return np.concatenate(each)


def predict_allan_deviation(
    drawn: list[SizeDraw],
    tau: Array,
    length: float,
    dt: float,
    ramp: tuple[float, float] = (0.0, 0.0),
) -> DeviationBand:
    """Predict the overlapping Allan deviation of a recording.

    Parameters
    ----------
    drawn : from `draw_sizes`
    tau : (t,) averaging times, s
    length : of the recording, s
    dt : s between samples
    ramp : of the channel and its standard deviation, units per s

    """
    variance = np.array([allan_variance(d.terms, d.x, tau, dt) for d in drawn]).T
    rng = np.random.default_rng(0)
    slope = ramp[0] + ramp[1] * rng.standard_normal(len(drawn))
    variance += slope**2 * tau[:, None] ** 2 / 2
    # the scatter of an estimate depends little on the sizes: a few draws suffice
    some = drawn[:: max(1, len(drawn) // SHAPES)]
    shapes = [
        [
            degrees_of_freedom(
                difference_covariances(
                    d.terms, d.x, t, dt, UNCORRELATED_TIMES * DIFFERENCES_PER_TIME
                ),
                t,
                length,
            )
            for d in some
        ]
        for t in tau.tolist()
    ]
    nu = np.repeat(np.mean(shapes, axis=1)[:, None], len(drawn), axis=1)
    scatter = variance[:, :, None] * rng.chisquare(nu[:, :, None], (*nu.shape, 16))
    measured = np.sqrt(scatter / nu[:, :, None]).reshape(len(tau), -1)
    low, median, high = np.quantile(measured, [0.16, 0.5, 0.84], axis=1)
    return DeviationBand(tau, median, low, high, variance, nu)
