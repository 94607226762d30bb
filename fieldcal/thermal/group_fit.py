"""Fits a group of parameters in several sessions by polynomials over temperature.

The values theta_s of a group's parameters in session s, with their covariance C_s, are

    theta_s = sum_{k=0}^{n} c_k P_k(x_s) + D_s u + d_s + e_s                        (1)
    c_k ~ N(0, (v 2^{1-k})^2),  k > 0;   c_0 of any size                            (2)
    u ~ N(0, r I),   e_s ~ N(0, (1 - r) C_s + (theta'(T_s) w_s)^2)                  (3)
    d_s ~ N(0, tau^2)                                                               (4)

P_k are the Legendre polynomials of x = (T - T_ref) / h, so that a higher order hardly
changes the lower coefficients; T_ref and h are middle and half width of the range. u is
the error that all sessions have in common, with D_s D_s = C_s: errors of base, gravity
and latitude are equal in each session, and do not affect differences between
temperatures. d_s changes from run to run, and w_s is the standard deviation of the
temperature within a session. The order n, the size v, the share r and the spread tau
are unknown. Each set of them is weighed by its evidence,

    ln Z = -(y^T R^-1 y - b^T L M^-1 L b + ln |R| + ln |M|) / 2                     (5)
    M = I + L G L,   G = H^T R^-1 H,   b = H^T R^-1 y                               (6)

with H the columns of (1), R the covariance of d + e, and L the square roots of the
priors (2), (3). The result is the mean over all sets, so that its uncertainty includes
that of the order. Source: D. MacKay, Neural Computation 4, 415 (1992).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Legendre, Polynomial

from fieldcal.core.samples import Array
from fieldcal.thermal.curves import TERMS, ThermalCurve

SHARES = {0.0: 0.5, 0.3: 1 / 6, 0.7: 1 / 6, 0.95: 1 / 6}
"""Prior probability of each r of (3): a common error is as likely as none."""

ORDER_RATIO = 2.0
"""Ratio of the sizes of successive orders, (2)."""

UNBOUNDED = 100.0
"""Prior standard deviation of c_0, over the largest difference between sessions."""


@dataclass(frozen=True, slots=True)
class GroupData:
    """Values of a group's p parameters in s sessions.

    Attributes
    ----------
    x : (s,) temperature over the range, -1 to 1
    y : (s, p) values less their mean `offset`, (p,)
    covariance : (s, p, p) of the values
    temperature_sd : (s,) standard deviation of the temperature in a session, K
    slope : (s, p) theta' of (3), per K

    """

    x: Array
    y: Array
    offset: Array
    covariance: Array
    temperature_sd: Array
    slope: Array

    def with_slope(self, slope: Array) -> GroupData:
        """The data with another theta'."""
        return replace(self, slope=slope)

    def without(self, i: int) -> GroupData:
        """The data without session i."""
        keep = np.arange(len(self.x)) != i
        some = (self.y, self.covariance, self.temperature_sd, self.slope)
        y, covariance, temperature_sd, slope = (part[keep] for part in some)
        return GroupData(
            self.x[keep], y, self.offset, covariance, temperature_sd, slope
        )

    @property
    def columns(self) -> Array:
        """H of (1): orders by parameters, then the common error, (s, p, 5 p)."""
        p = self.y.shape[1]
        legendre = np.polynomial.legendre.legvander(self.x, TERMS - 1)
        orders = np.einsum("sk,ij->sikj", legendre, np.eye(p)).reshape(-1, p, TERMS * p)
        values, vectors = np.linalg.eigh(self.covariance)
        root = np.sqrt(np.maximum(values, 0.0))[:, None, :]
        together = (vectors * root) @ vectors.transpose(0, 2, 1)
        return np.concatenate([orders, together], axis=2)

    def noise(self, share: Array, spread: Array) -> Array:
        """R of (5) of each session, (m, s, p, p), for m shares and spreads."""
        own = (1 - share)[:, None, None, None] * self.covariance
        diagonal = (self.slope * self.temperature_sd[:, None]) ** 2 + spread[
            :, None, None
        ] ** 2
        return own + diagonal[..., None] * np.eye(self.y.shape[1])


@dataclass(frozen=True, slots=True)
class GroupFit:
    """Fits of a group with all sets of n, v, r and tau, and their weights.

    Attributes
    ----------
    weights : (m,) of the sets, sum 1
    sets : (m, 4) n, v, r and tau
    means : (m, 5 p) of c and u
    covariances : (m, 5 p, 5 p) of c and u
    offset : (p,) subtracted from the values before the fit

    """

    weights: Array
    sets: Array
    means: Array
    covariances: Array
    offset: Array

    @property
    def mean(self) -> Array:
        """Mean of c and u over all sets, (5 p,)."""
        return np.asarray(self.weights @ self.means)

    @property
    def covariance(self) -> Array:
        """Covariance of c and u, within and between the sets, (5 p, 5 p)."""
        off = self.means - self.mean
        within = np.einsum("m,mij->ij", self.weights, self.covariances)
        return np.asarray(within + np.einsum("m,mi,mj->ij", self.weights, off, off))

    def slopes(self, x: Array) -> Array:
        """Derivative of theta by x, (s, p)."""
        c = self.mean[: TERMS * len(self.offset)].reshape(TERMS, -1)
        derivative = np.polynomial.legendre.legder(c)
        return np.asarray(np.polynomial.legendre.legval(x, derivative).T)

    def curve(self, j: int, half: float, unit: str, held_out: Array) -> ThermalCurve:
        """Curve of parameter j, in powers of K; `half` is h in K."""
        p = len(self.offset)
        mine = np.arange(TERMS) * p + j
        to = _legendre_to_powers(half)
        a = to @ self.mean[mine]
        a[0] += self.offset[j]
        covariance = to @ self.covariance[np.ix_(mine, mine)] @ to.T
        orders = np.array([
            self.weights[self.sets[:, 0] == n].sum() for n in range(TERMS)
        ])  # fmt: skip
        spread = float(np.sqrt(self.weights @ self.sets[:, 3] ** 2))
        return ThermalCurve(unit, a, covariance, orders, spread, held_out)


def _legendre_to_powers(half: float) -> Array:
    """Matrix that converts coefficients of Legendre polynomials of x to powers of K."""
    out = np.zeros((TERMS, TERMS))
    for k in range(TERMS):
        series: Array = np.asarray(Legendre.basis(k).convert(kind=Polynomial).coef)
        out[: k + 1, k] = series / half ** np.arange(k + 1)
    return out


def fit_group(data: GroupData, sets: Array) -> GroupFit:
    """Fit a group with each set: mean, covariance and weight, (5), (6)."""
    h, p = data.columns, data.y.shape[1]
    pairs, which = np.unique(sets[:, 2:], axis=0, return_inverse=True)
    noise = data.noise(*pairs.T)
    inverse = np.linalg.inv(noise)
    weighted = inverse @ h
    g = np.einsum("sia,msib->mab", h, weighted)[which]
    b = np.einsum("msia,si->ma", weighted, data.y)[which]
    square = np.einsum("si,msij,sj->m", data.y, inverse, data.y)
    log_noise = np.linalg.slogdet(noise)[1].sum(axis=1)
    root = _prior_roots(
        sets, p, float(np.abs(data.y).max() + np.sqrt(data.covariance.max()))
    )
    m = np.eye(h.shape[2]) + root[:, :, None] * g * root[:, None, :]
    covariances = root[:, :, None] * np.linalg.inv(m) * root[:, None, :]
    means = np.einsum("mab,mb->ma", covariances, b)
    ln_z = 0.5 * (np.einsum("ma,ma->m", b, means) - np.linalg.slogdet(m)[1])
    ln_z -= 0.5 * (square + log_noise)[which]
    ln_z += np.log([SHARES[share] for share in sets[:, 2]])
    weights = np.exp(ln_z - ln_z.max())
    return GroupFit(weights / weights.sum(), sets, means, covariances, data.offset)


def _prior_roots(sets: Array, p: int, wide: float) -> Array:
    """L of (6): square roots of the priors of c and u, (m, 5 p)."""
    k = np.arange(TERMS)
    order, size, share = sets[:, 0, None], sets[:, 1, None], sets[:, 2, None]
    terms = np.where(k <= order, size * ORDER_RATIO ** (1.0 - k), 0.0)
    terms[:, 0] = UNBOUNDED * wide
    each = [np.repeat(terms, p, axis=1), np.repeat(np.sqrt(share), p, axis=1)]
    return np.concatenate(each, axis=1)


def held_out_residual(data: GroupData, sets: Array, i: int) -> Array:
    """Session i less the prediction from the others, over its uncertainty, (p,)."""
    found = fit_group(data.without(i), sets)
    h = data.columns[i]
    off = data.y[i] - found.means @ h.T
    noise = data.noise(sets[:, 2], sets[:, 3])[:, i]
    spread = np.einsum("pa,mab,pb->mp", h, found.covariances, h)
    spread += noise[:, np.arange(len(h)), np.arange(len(h))]
    mean = found.weights @ off
    variance = found.weights @ (spread + (off - mean) ** 2)
    return np.asarray(mean / np.sqrt(variance))
