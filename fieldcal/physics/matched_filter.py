"""Amplitude of a push of a given length at each instant, and how unusual it is.

A push there and back is a half sine of length w. Over 2 w around it the output has a
level and a slope besides. The least-squares amplitude of the half sine at the instant
i, in its own standard deviations under white noise, is

    a_i = sum_j c_j z_{i+j},     sum c_j^2 = 1                                      (1)

where c is the half sine without its own level and slope. Where a base sways or a hand
trembles, a scatters more than white noise makes it. Its variance at i has two
witnesses: the same window away from i, s_i^2 with N_i degrees of freedom, and the other
windows, s_0^2 with nu_0 (`window_variances`):

    v_i = max(1, (N_i s_i^2 + nu_0 s_0^2) / (N_i + nu_0)),     nu = N_i + nu_0      (2)

Of s_0^2, 1 is the white noise of all windows; the rest, the part w = 1 - 1 / s_0^2, is
how they sway or tremble, and that of a hand differs from window to window, of which a
few windows tell little: nu_0 is at most `SWAY_DOF` / w^2. A hand that trembles about
one axis may lean about another in the next window, so w is the largest of the six.

A push moves the three axes of a triad at the same time. With R the correlation of
their amplitudes and b = a / sqrt v, q_i = b' R^-1 b is without a push three times a
variable of Fisher's distribution F(3, nu). The logarithm of its tail is

    ln P_i = -nu ln(1 + q / nu) / 2 + ln(1 + nu q / (nu + q) / 2) / 2               (3)

the mean of those for 2 and for 4 axes, which are exact; 4 to 12 % low in P.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.physics.window_variances import variances_of_others

TAPS = 12
"""Block means in the length of a push, where it has more samples."""

MAX_CORRELATED_SIGMAS = 3.0
"""Standard deviations beyond which an amplitude counts no more in a correlation."""

POOLED_DOF, UNCORRELATED_DOF = 4.0, 1.0
"""Weights in a window's correlation of the mean of all windows and of axes that move
each by itself, in degrees of freedom."""


SWAY_DOF = 2.0
"""Degrees of freedom by which the variance of a hand's sway differs between windows: 1
to 2.6 in the eight windows of a real recording by hand (MPU-6050, pushes of 0.5 s)."""


@dataclass(frozen=True, slots=True)
class MatchedFilter:
    """Filter for a push of one length.

    Attributes
    ----------
    block : samples whose mean is one value of the filter's input
    taps : (m,) c of (1)
    sigma : standard deviation of the least-squares height of the half sine, in those of
        a sample

    """

    block: int
    taps: Array
    sigma: float

    @classmethod
    def for_length(cls, samples: int) -> MatchedFilter:
        """For a push of so many samples, at least 2."""
        block = max(samples // TAPS, 1)
        n = max(round(samples / block), 2)
        beside = np.zeros(n // 2)
        wave = np.sin(np.pi * (np.arange(n) + 0.5) / n)
        shape = np.concatenate([beside, wave, beside])
        course = np.column_stack([np.ones(len(shape)), np.arange(len(shape))])
        shape -= course @ np.linalg.lstsq(course, shape, rcond=None)[0]
        norm = float(np.linalg.norm(shape))
        return cls(block, shape / norm, 1 / (norm * np.sqrt(block)))

    def stretch(self, i: int) -> tuple[int, int]:
        """First and one past the last sample of the `i`-th half sine."""
        beside = len(self.taps) // 4
        return (i + beside) * self.block, (i + len(self.taps) - beside) * self.block

    @property
    def amplitudes_per_dof(self) -> float:
        """Amplitudes that make one degree of freedom of the mean of their squares."""
        correlation = np.correlate(self.taps, self.taps, "full")
        return float(np.square(correlation).sum())

    def amplitudes(self, z: Array) -> Array:
        """(1) of outputs (n, c) in standard deviations of white noise, (k, c).

        The `i`-th is of the samples from `i * block` on; nan where one is missing.
        """
        blocks = len(z) // self.block
        if blocks < len(self.taps):
            return np.empty((0, z.shape[1]))
        parts = z[: blocks * self.block].reshape(blocks, self.block, -1)
        inputs = parts.sum(axis=1) / np.sqrt(self.block)
        out: Array = sliding_window_view(inputs, len(self.taps), axis=0) @ self.taps
        return out


@dataclass(frozen=True, slots=True)
class AmplitudeNoise:
    """What the amplitudes in one window scatter by without a push.

    Attributes
    ----------
    variance : (k, c) or (c,) v
    dof : (k, c) or (c,) nu
    correlation : (c, c) R

    """

    variance: Array
    dof: Array
    correlation: Array

    def at(self, i: int) -> AmplitudeNoise:
        """The noise at one instant."""
        return AmplitudeNoise(self.variance[i], self.dof[i], self.correlation)

    def log_chances(self, amplitudes: Array) -> Array:
        """(3) of amplitudes (k, 6) for each triad, (k, 2); what is missing is 0."""
        b = np.nan_to_num(amplitudes) / np.sqrt(self.variance)
        out = np.zeros((len(b), 2))
        for triad, axes in enumerate((ACC, GYR)):
            inverse = np.linalg.inv(self.correlation[axes, axes])
            q = np.einsum("ij,jk,ik->i", b[:, axes], inverse, b[:, axes])
            nu = np.maximum(self.dof[..., axes].mean(axis=-1), 1e-9)
            four = np.log1p(nu * q / (nu + q) / 2)
            out[:, triad] = (four - nu * np.log1p(q / nu)) / 2  # (3)
        return out


def amplitude_noise(
    windows: Sequence[Array], matched: MatchedFilter
) -> list[AmplitudeNoise]:
    """Noise of the amplitudes in each window; `windows` has those of each, (k, 6)."""
    square = [np.nan_to_num(np.square(a)) for a in windows]
    known = [np.isfinite(a).astype(float) for a in windows]
    count = np.array([k.sum(axis=0) for k in known])
    total = np.array([s.sum(axis=0) for s in square])
    each, near = matched.amplitudes_per_dof, len(matched.taps)
    common, nu = variances_of_others(total / np.maximum(count, 1.0), count / each)
    swaying = 1 - 1 / np.maximum(common, 1.0).max(axis=1, keepdims=True)
    nu = np.minimum(nu, SWAY_DOF / np.maximum(swaying, 1e-3) ** 2)
    noise = []
    for w in range(len(windows)):
        left = count[w] - _sums_around(known[w], near)
        away = np.maximum(total[w] - _sums_around(square[w], near), 0.0)
        dof = left / each + nu[w]
        v = (away / each + nu[w] * common[w]) / np.maximum(dof, 1e-9)  # (2)
        noise.append((np.maximum(v, 1.0), dof))
    own = [_products(a / np.sqrt(v)) for a, (v, _) in zip(windows, noise, strict=True)]
    pooled = sum(own) / max(sum(len(a) for a in windows), 1)
    return [
        AmplitudeNoise(v, dof, _correlation(one / each + POOLED_DOF * pooled))
        for one, (v, dof) in zip(own, noise, strict=True)
    ]


def _sums_around(values: Array, near: int) -> Array:
    """Sums (k, c) over the values that are less than `near` rows away."""
    k = len(values)
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    ends = np.minimum(np.arange(k) + near, k)
    starts = np.maximum(np.arange(k) - near + 1, 0)
    sums: Array = total[ends] - total[starts]
    return sums


def _products(b: Array) -> Array:
    """Sum of products of standardised amplitudes (k, c), (c, c)."""
    clipped = np.clip(np.nan_to_num(b), -MAX_CORRELATED_SIGMAS, MAX_CORRELATED_SIGMAS)
    out: Array = clipped.T @ clipped
    return out


def _correlation(products: Array) -> Array:
    """Correlation by sums of products (c, c) of so many degrees of freedom."""
    products = products + UNCORRELATED_DOF * np.eye(len(products))
    size = np.sqrt(np.diag(products))
    out: Array = products / np.outer(size, size)
    return out
