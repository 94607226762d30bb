"""Whether another device follows where the biases jump within a session.

A device that was switched off has the biases of another run. If it was exchanged, or
its range or filter was set otherwise, the scale factors are other ones, although the
fit assumes them to be the same, and the samples usually have other noise and another
step. With s_r the spread of biases from run to run, jumps v of the biases with
uncertainties s, and the log d of the ratio of the noise of a triad,

    B = [1 + prod N(v; 0, 2 (k s_r)^2 + s^2) / prod N(v; 0, 2 s_r^2 + s^2)] / 2
        * prod N(d; 0, D^2) / [(1 - c) prod N(d; 0, s_d^2) + c prod N(d; 0, D^2)]
        * P(steps | exchanged) / P(steps | same)                                   (1)

is the likelihood ratio of another device to the same one. Half of such pairs have been
calibrated alike; the others differ by k times what runs do. c is the chance that the
noise of one device changes meanwhile, as when an engine is started.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.acceptance.rest_steps import SPECTRUM, white_noise
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.names import group_of
from fieldcal.core.probability import probability_of_log_odds
from fieldcal.core.samples import ACC, GYR, Array, Block
from fieldcal.physics.recording import grids_of
from fieldcal.windows import Average

EXCHANGED = 0.02
"""Chance that a device whose biases jump was exchanged, or set otherwise."""

DOUBT = 0.1
"""Probability of that above which there is no GO."""

BETWEEN_DEVICES = 5.0
"""Spread of biases between devices, k of (1)."""

NOISE_SPREAD, SAME_SPREAD, CHANGES = 1.0, 0.1, 0.02
"""Spread of the log of the noise between devices, D, and of one device in two windows;
the chance c that it changes."""

SAME_STEPS = 0.9999, 0.3
"""Chance that the steps of outputs stay, of one device set alike, and of another."""

SEEN = 2.0
"""Change of the noise that is told of, in its standard deviations."""

STEP_OF_NOISE = 0.1
"""Least step, in noise of a sample, that is the device's: numbers of single precision
have finer ones, which change with their size."""

STEP_PART = 0.01
"""Part by which two steps that are the same may seem to differ."""


def exchange_text(
    calibration: Calibration,
    block: Block,
    windows: Sequence[Average],
    limits: GradeLimits,
) -> str:
    """Sentence if another device seems to follow after a jump; else empty.

    Parameters
    ----------
    calibration : of the session
    block : its samples
    windows : at rest
    limits : of the device's grade

    """
    jump = calibration.info.get("jump")
    if not jump:
        return ""
    at_s = float(jump["at_s"])
    held = [one for w in windows if len(one := block.between(w.start, w.end))]
    held = [one for one in held if len(one) >= SPECTRUM]
    before = [one for one in held if one.t[-1] < at_s]
    after = [one for one in held if one.t[0] > at_s]
    if not before or not after:
        return ""
    noise = _NoiseChange.of(before, after)
    stepped = _steps_change(block, at_s, [*before, *after])
    log_odds = np.log(EXCHANGED / (1 - EXCHANGED))
    log_odds += _log_ratio_of_jumps(jump["bias"], limits) + noise.log_ratio()
    if stepped is not None:
        same, other = (1 - p if stepped else p for p in SAME_STEPS)
        log_odds += np.log(other / same)
    chance = float(probability_of_log_odds(log_odds))
    if chance <= DOUBT:
        return ""
    told = [*noise.told(), *(["the step of its outputs changes"] if stepped else [])]
    also = "".join(f", {one}" for one in told)
    return (
        f"at {at_s:.0f} s of device time the biases jump{also}:"
        " another device was put in its place, or its range or filter was set"
        f" otherwise (probability {chance:.2f}); record all positions of one device,"
        " set alike"
    )


@dataclass(frozen=True, slots=True)
class _NoiseChange:
    """Change of the noise of each triad.

    Attributes
    ----------
    change : (n,) log of the ratio of the noise after to that before
    sigma : (n,) of the same for one device
    names : of the triads

    """

    change: Array
    sigma: Array
    names: tuple[str, ...]

    @classmethod
    def of(cls, before: Sequence[Block], after: Sequence[Block]) -> _NoiseChange:
        """The change from windows before to those after."""
        parts = [np.array([*map(_log_noise, some)]) for some in (before, after)]
        change = parts[1].mean(axis=0) - parts[0].mean(axis=0)
        left = np.concatenate([part - part.mean(axis=0) for part in parts])
        scatter = np.sqrt((left**2).sum(axis=0) / max(len(left) - 2, 1))
        count = np.sqrt(1 / len(parts[0]) + 1 / len(parts[1]))
        sigma = np.hypot(SAME_SPREAD, scatter) * count
        known = np.isfinite(change)
        names = np.array(["accelerometers", "gyroscopes"])[known]
        return cls(change[known], sigma[known], tuple(names.tolist()))

    def log_ratio(self) -> float:
        """Log of the factor of (1) for the noise."""
        wide = _log_normal(self.change, np.hypot(NOISE_SPREAD, self.sigma))
        near = _log_normal(self.change, self.sigma)
        same = np.logaddexp(near + np.log1p(-CHANGES), wide + np.log(CHANGES))
        return float(wide - same)

    def told(self) -> list[str]:
        """The changes that are seen, in words."""
        each = zip(self.names, self.change, self.sigma, strict=True)
        return [
            f"the noise of the {name} is {np.exp(one):.2g} times what it was"
            for name, one, sigma in each
            if abs(one) > SEEN * sigma
        ]


def _log_noise(one: Block) -> Array:
    """Log of the white noise of accelerometers and gyroscopes, (2,); nan if unknown."""
    noise = white_noise(one.six)
    level = np.where(noise > 0, noise, np.nan)
    return np.array([np.log(level[triad]).mean() for triad in (ACC, GYR)])


def _log_normal(values: Array, sigma: Array) -> float:
    """Log of the product of normal densities about zero, without a constant."""
    return float(-np.sum(np.log(sigma) + (values / sigma) ** 2 / 2))


def _log_ratio_of_jumps(
    bias: dict[str, tuple[float, float]], limits: GradeLimits
) -> float:
    """Log of the factor of (1) for the jumps of biases."""
    repeats = {name: limits.repeat(group_of(name)) for name in bias}
    known = [(*bias[name], one) for name, one in repeats.items() if one is not None]
    value, sigma, repeat = np.array(known, dtype=float).reshape(-1, 3).T
    same, other = (
        _log_normal(value, np.sqrt(2 * (k * repeat) ** 2 + sigma**2))
        for k in (1.0, BETWEEN_DEVICES)
    )
    return float(np.logaddexp(0.0, other - same) - np.log(2.0))


def _steps_change(block: Block, at_s: float, held: Sequence[Block]) -> bool | None:
    """Whether the step of an output changes at a time, s; None if none has a step.

    `held` are the windows at rest, which show the noise.
    """
    cut = int(np.searchsorted(block.t, at_s))
    a, b = grids_of(block[:cut]), grids_of(block[cut:])
    noise = np.median([white_noise(one.six) for one in held], axis=0)
    known = np.minimum(a, b) > STEP_OF_NOISE * noise
    if not known.any():
        return None
    return bool((np.abs(a - b)[known] > STEP_PART * a[known]).any())
