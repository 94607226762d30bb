"""How likely rates at rest are if a device keeps its bias, follows it, or averages it.

A device that follows the bias b of a gyroscope at rest subtracts an estimate. With
u = b less this estimate, the rate w that the gyroscope feels there, and white noise n
of spectral density S,

    output = u + w + n,    du/dt = -output / tau + slow changes of b               (1)

At the end of a step of s seconds, with x = s / tau, and for the mean over it,

    u' = u - (1 - exp(-x)) (u + w) - W,    var W = S (1 - exp(-2 x)) / 2 tau       (2)
    mean = ((1 - exp(-x)) (u + w) + W) / x + e,    var e = SENT_AFTER S / s        (3)

and a device that keeps its bias is one of infinite tau, mean = u + w + noise of S / s.
At each turn w is another one. All means between two turns tell of u and w at the
beginning, x = (u_0, w_0): a Kalman filter of u for given x, of which u and each mean
less its prediction are linear,

    u = a^T x + b + noise of variance P,    off = e - g^T x, of variance v          (4)

adds up what they say, with C = sum g g^T / v, B = sum g e / v, and Q = sum e^2 / v.
Many cases have the tau and the walk of one filter in common, and differ in the mean m
and the covariance X of x before the means. With E = B - C m they have

    chi^2 = Q - 2 B^T m + m^T C m - E^T X' E,    X' = (X^-1 + C)^-1                 (5)
    -2 ln p = chi^2 + sum ln v + ln |1 + X C|,    m' = m + X' E                     (6)

for each axis, and all cases side by side.
Source: B. D. O. Anderson and J. B. Moore, Optimal Filtering, 1979, sections 3.1 and 5.4
(noise of the state and of the measurement correlated), and 6.3 (information).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fieldcal.acceptance.rest_steps import RestStep
from fieldcal.core.samples import Array, Index

SENT_AFTER = 0.02
"""Part of the noise, in power, that comes behind the subtraction, as that of rounding
does."""

NO_TIME = 1e-9
"""Least time of a step, s, in which nothing changes."""

CASE = np.dtype(
    [
        (name, float)
        for name in ("tau", "start", "felt", "put_in", "walk", "blind", "share")
    ]
)
"""What a device may do to its biases; variances in (rad/s)^2.

``tau``: time constant with which the bias is followed, s; inf if it is kept
``start``: variance of u at the beginning
``felt``: variance of w
``put_in``: variance of what a turn puts into u
``walk``: variance by which the bias itself changes in a second
``blind``: time after each turn of which nothing is used, s
``share``: probability of the case
"""

Cases = NDArray[np.void]
"""Cases, (h,) of `CASE`."""


def log_likelihoods(
    steps: Sequence[RestStep], density: Array, restart: float, cases: Cases
) -> tuple[Array, Array, Array]:
    """Log likelihood, chi-squared and number of all means for each case, (h,) each.

    Parameters
    ----------
    steps : of rest; results have the leading axes of their rates before h
    density : (a,) spectral density S of the white noise, (rad/s)^2 s
    restart : variance of a change of the bias where the device may have been off
    cases : what the device may do

    """
    names = ["tau", "walk", "blind"]
    every = np.column_stack([cases[name] for name in names])
    kinds, kind = np.unique(every, axis=0, return_inverse=True)
    found = _Biases(len(density), cases, kind.reshape(-1))
    rest = _Rest(density[:, None], *kinds.T)
    for step in steps:
        if step.turned:
            found.learn(rest)
            found.turn(restart if step.lost else 0.0)
            rest = _Rest(density[:, None], *kinds.T)
        rest.add(step)
    found.learn(rest)
    return found.log_likelihood.sum(axis=-2), found.chi2.sum(axis=-2), found.count


class _Rest:
    """Means between two turns, for each kind of case: (4), (..., a, k) each.

    Attributes
    ----------
    by_u, by_w, beside, spread : a, b and P of u at the end
    inner : C, of which the elements are those of u, of u and w, and of w
    towards : B, of u and of w
    square, log_det : Q, and the sum of ln v
    count : (..., k) means

    """

    def __init__(self, density: Array, tau: Array, walk: Array, blind: Array) -> None:
        self._density, self._tau, self._walk, self._blind = density, tau, walk, blind
        zero = np.zeros((len(density), len(tau)))
        self.by_u, self.by_w = zero + 1.0, zero
        self.beside, self.spread = zero, zero
        self.inner, self.towards = (zero, zero, zero), (zero, zero)
        self.square, self.log_det, self.count = zero, zero, zero[0]

    def add(self, step: RestStep) -> None:
        """Time passes, (2), and the mean over it is taken in, (3)."""
        s, density = np.maximum(step.seconds, NO_TIME)[..., None], self._density
        x = s / self._tau
        part = -np.expm1(-x)
        follows, x_or_1 = x > 0, np.where(x > 0, x, 1.0)
        change = np.where(follows, 0.5 * density / s * x * -np.expm1(-2 * x), 0.0)
        own = np.where(follows, change / x_or_1**2, density / s)
        own = own + SENT_AFTER * density / s
        gain, common = np.where(follows, part / x_or_1, 1.0), -change / x_or_1
        late = np.asarray(step.since_turn)[..., None] >= self._blind
        seen = np.isfinite(step.rates)[..., None] & late
        of_u, of_w = gain * self.by_u, gain * (self.by_w + 1.0)
        off = np.nan_to_num(step.rates)[..., None] - gain * self.beside
        var = gain**2 * self.spread + own
        told = seen / var
        to_u = (gain * (1 - part) * self.spread + common) * told
        uu, uw, ww = self.inner
        by_u, by_w = of_u * told, of_w * told
        self.inner = uu + by_u * of_u, uw + by_u * of_w, ww + by_w * of_w
        self.towards = self.towards[0] + by_u * off, self.towards[1] + by_w * off
        self.square = self.square + told * off**2
        self.log_det = self.log_det + np.where(seen, np.log(var), 0.0)
        self.by_u = (1 - part) * self.by_u - to_u * of_u
        self.by_w = (1 - part) * self.by_w - part - to_u * of_w
        self.beside = (1 - part) * self.beside + to_u * off
        walked = (1 - part) ** 2 * self.spread + change + self._walk * s
        self.spread = walked - to_u**2 * var
        self.count = self.count + seen.sum(axis=-2)


class _Biases:
    """Means and covariances of u and w, (..., a, h) each.

    `kind` (h,) is that of each case.

    Attributes
    ----------
    log_likelihood, chi2 : (..., a, h) of the means so far
    count : (..., h) of these means

    """

    def __init__(self, axes: int, cases: Cases, kind: Index) -> None:
        self._cases, self._kind = cases, kind
        zero = np.zeros((axes, len(cases)))
        self._u, self._w, self._uw = zero, zero, zero
        self._uu, self._ww = zero + cases["start"], zero + cases["felt"]
        self.log_likelihood, self.chi2, self.count = zero, zero, zero[0]

    def turn(self, restart: float) -> None:
        """Something is put into u, and w is another one."""
        zero = np.zeros_like(self._u)
        self._uu = self._uu + self._cases["put_in"] + restart
        self._w, self._uw, self._ww = zero, zero, zero + self._cases["felt"]

    def learn(self, rest: _Rest) -> None:
        """Take in the means of a time at rest, (5) and (6), and go to its end, (4)."""
        uu, uw, ww, u, w = self._uu, self._uw, self._ww, self._u, self._w
        c_uu, c_uw, c_ww = (part[..., self._kind] for part in rest.inner)
        b_u, b_w = (part[..., self._kind] for part in rest.towards)
        square, log_det, a_u, a_w, beside, spread = (
            part[..., self._kind]
            for part in (rest.square, rest.log_det, rest.by_u, rest.by_w,
                         rest.beside, rest.spread)
        )  # fmt: skip
        e_u, e_w = b_u - c_uu * u - c_uw * w, b_w - c_uw * u - c_ww * w
        size, known = uu * ww - uw**2, c_uu * c_ww - c_uw**2
        less = 1 + uu * c_uu + 2 * uw * c_uw + ww * c_ww + size * known  # |1 + X C|
        uu, uw, ww = (
            (uu + size * c_ww) / less, (uw - size * c_uw) / less,
            (ww + size * c_uu) / less,
        )  # fmt: skip
        to_u, to_w = uu * e_u + uw * e_w, uw * e_u + ww * e_w
        chi2 = square - u * (b_u + e_u) - w * (b_w + e_w) - to_u * e_u - to_w * e_w
        u, w = u + to_u, w + to_w
        self._u, self._w = a_u * u + a_w * w + beside, w
        self._uu = a_u**2 * uu + 2 * a_u * a_w * uw + a_w**2 * ww + spread
        self._uw, self._ww = a_u * uw + a_w * ww, ww
        self.chi2 = self.chi2 + chi2
        told = chi2 + log_det + np.log(less)
        self.log_likelihood = self.log_likelihood - 0.5 * told
        self.count = self.count + rest.count[..., self._kind]
