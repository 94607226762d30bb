"""How likely rates at rest are if a device keeps its bias, follows it, or averages it.

A device that follows the bias b of a gyroscope at rest subtracts an estimate. With
u = b less this estimate, the rate w that the gyroscope feels there, and white noise n
of spectral density S,

    output = u + w + n,    du/dt = -output / tau + slow changes of b               (1)

At the end of a step of s seconds, with x = s / tau, and for the mean over it,

    u' = u - (1 - exp(-x)) (u + w) - W,    var W = S (1 - exp(-2 x)) / 2 tau       (2)
    mean = ((1 - exp(-x)) (u + w) + W) / x + e,    var e = SENT_AFTER S / s        (3)

and a device that keeps its bias is one of infinite tau, mean = u + w + noise of S / s.
At each turn w is another one. The likelihood is that of a Kalman filter with the states
u and w: for each axis, and many cases (tau and spreads) side by side.
Source: B. D. O. Anderson and J. B. Moore, Optimal Filtering, 1979, sections 3.1 and 5.4
(noise of the state and of the measurement correlated).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fieldcal.acceptance.rest_steps import RestStep
from fieldcal.core.samples import Array

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
    found = _Filter(density[:, None], cases)
    for step in steps:
        if step.turned:
            found.turn(restart if step.lost else 0.0)
        found.rest(step)
    return found.log_likelihood.sum(axis=-2), found.chi2.sum(axis=-2), found.count


class _Filter:
    """Means and covariances of u and w, (..., a, h) each.

    Attributes
    ----------
    log_likelihood, chi2 : (..., a, h) of the means so far
    count : (..., h) of these means

    """

    def __init__(self, density: Array, cases: Cases) -> None:
        self._density, self._cases = density, cases
        zero = np.zeros((len(density), len(cases)))
        self._u, self._w, self._uw = zero, zero, zero
        self._uu, self._ww = zero + cases["start"], zero + cases["felt"]
        self.log_likelihood, self.chi2, self.count = zero, zero, zero[0]

    def turn(self, restart: float) -> None:
        """Something is put into u, and w is another one."""
        zero = np.zeros_like(self._u)
        self._uu = self._uu + self._cases["put_in"] + restart
        self._w, self._uw, self._ww = zero, zero, zero + self._cases["felt"]

    def rest(self, step: RestStep) -> None:
        """Time passes, (2), and the mean over it is taken in, (3)."""
        cases = self._cases
        s = np.maximum(step.seconds, NO_TIME)[..., None]
        x = s / cases["tau"]
        part = -np.expm1(-x)
        follows, x_or_1 = x > 0, np.where(x > 0, x, 1.0)
        density = self._density
        change = np.where(follows, 0.5 * density / s * x * -np.expm1(-2 * x), 0.0)
        own = np.where(follows, change / x_or_1**2, density / s)
        own = own + SENT_AFTER * density / s
        gain, common = np.where(follows, part / x_or_1, 1.0), -change / x_or_1
        late = np.asarray(step.since_turn)[..., None] >= cases["blind"]
        seen = np.isfinite(step.rates)[..., None] & late
        r_u, r_w = self._uu + self._uw, self._uw + self._ww  # covariances with u + w
        rate, r_r = self._u + self._w, r_u + r_w
        off = np.where(seen, np.nan_to_num(step.rates)[..., None] - gain * rate, 0.0)
        var = gain**2 * r_r + own
        to_u = np.where(seen, gain * (r_u - part * r_r) + common, 0.0) / var
        to_w = np.where(seen, gain * r_w, 0.0) / var
        self._u = self._u - part * rate + to_u * off
        self._w = self._w + to_w * off
        walked = self._uu - 2 * part * r_u + part**2 * r_r + change + cases["walk"] * s
        self._uu = walked - to_u**2 * var
        self._uw = self._uw - part * r_w - to_u * to_w * var
        self._ww = self._ww - to_w**2 * var
        told = np.where(seen, np.log(var) + off**2 / var, 0.0)
        self.log_likelihood = self.log_likelihood - 0.5 * told
        self.chi2 = self.chi2 + off**2 / var
        self.count = self.count + seen.sum(axis=-2)
