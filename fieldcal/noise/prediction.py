"""The Allan deviation that another recording of the device will have.

A band holds what is not known of the processes (how large, and which, by the weights of
`terms`), and the scatter of the estimate from a recording of its length. The sizes are
drawn from their density with the reference prior (`reference`): from the normal
distribution about its maximum, weighted by the density and drawn again (Rubin 1987).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import NoiseFit, bounds
from fieldcal.noise.processes import (
    FAR,
    STEPS,
    allan_variance,
    covariances,
    freedom,
)
from fieldcal.noise.reference import SizeDensity
from fieldcal.noise.spectrum import CosineSpectrum
from fieldcal.noise.terms import Chosen

DRAWS = 200
SHAPES = 8
WIDER = 1.3
"""Standard deviations of what is drawn from, so that the tails are there."""

FURTHEST = 3.0
"""No logarithm is drawn further from its maximum."""


@dataclass(frozen=True, slots=True)
class Draw:
    """Sizes of processes as they may be, with how often they were drawn."""

    terms: tuple[str, ...]
    x: Array


@dataclass(frozen=True, slots=True)
class DeviationBand:
    """What the Allan deviation of another recording will be.

    Attributes
    ----------
    tau : (t,) s
    median, low, high : (t,) deviation, and what holds 68 of 100
    variance, freedom : (t, d) of each draw, of which the estimate is chi squared

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


def draws(spectrum: CosineSpectrum, chosen: Chosen, seed: int = 0) -> list[Draw]:
    """Sizes of the processes of a channel as they may be."""
    rng = np.random.default_rng(seed)
    out: list[Draw] = []
    for weight, one in chosen.others:
        number = round(weight * DRAWS)
        if number:
            out += _of_fit(spectrum, chosen, one, number, rng)
    return out


def _of_fit(
    spectrum: CosineSpectrum,
    chosen: Chosen,
    one: NoiseFit,
    number: int,
    rng: np.random.Generator,
) -> list[Draw]:
    values, axes = np.linalg.eigh(one.covariance)
    spread = WIDER * axes * np.sqrt(np.maximum(values, 0.0))
    standard = rng.standard_normal((2 * number, len(one.x)))
    steps = np.clip(standard @ spread.T, -FURTHEST, FURTHEST)
    tried = np.clip(one.x + steps, *bounds(spectrum, one.terms))
    weights = _density(spectrum, chosen, one, tried)
    weights += 0.5 * np.sum(standard**2, axis=1)
    chance = np.exp(weights - weights.max())
    picked = rng.choice(len(tried), number, p=chance / chance.sum())
    return [Draw(one.terms, tried[i]) for i in picked]


def _density(
    spectrum: CosineSpectrum, chosen: Chosen, one: NoiseFit, tried: Array
) -> Array:
    """Log density (d,) of sizes and times (d, p)."""
    sizes = tried[:, : len(one.terms)]
    if not one.timed:
        of = SizeDensity.of(spectrum, chosen.powers, one.terms, one.x)
        return of.at(sizes)
    each = [
        SizeDensity.of(spectrum, chosen.powers, one.terms, x).at(
            x[None, : len(one.terms)]
        )
        for x in tried
    ]
    return np.concatenate(each)


def predict(
    drawn: list[Draw],
    tau: Array,
    length: float,
    dt: float,
    ramp: tuple[float, float] = (0.0, 0.0),
) -> DeviationBand:
    """Predict the overlapping Allan deviation of a recording.

    Parameters
    ----------
    drawn : of `draws`
    tau : (t,) averaging times, s
    length : of the recording, s
    dt : s between samples
    ramp : of the channel and its standard deviation, units per s

    """
    variance = np.array([allan_variance(d.terms, d.x, tau, dt) for d in drawn]).T
    rng = np.random.default_rng(0)
    slope = ramp[0] + ramp[1] * rng.standard_normal(len(drawn))
    variance += slope**2 * tau[:, None] ** 2 / 2
    # how an estimate scatters depends on the sizes little: some of them tell it
    some = drawn[:: max(1, len(drawn) // SHAPES)]
    shapes = [
        [
            freedom(covariances(d.terms, d.x, t, dt, FAR * STEPS), t, length)
            for d in some
        ]
        for t in tau.tolist()
    ]
    nu = np.repeat(np.mean(shapes, axis=1)[:, None], len(drawn), axis=1)
    scatter = variance[:, :, None] * rng.chisquare(nu[:, :, None], (*nu.shape, 16))
    measured = np.sqrt(scatter / nu[:, :, None]).reshape(len(tau), -1)
    low, median, high = np.quantile(measured, [0.16, 0.5, 0.84], axis=1)
    return DeviationBand(tau, median, low, high, variance, nu)
