"""A group of parameters in several sessions as one polynomial over temperature.

The values theta_s of a group's parameters in session s, with their covariance C_s, are

    theta_s = sum_{k=0}^{n} c_k P_k(x_s) + D_s u + d_s + e_s                        (1)
    c_k ~ N(0, (v 2^{1-k})^2),  k > 0;   c_0 of any size                            (2)
    u ~ N(0, r I),   e_s ~ N(0, (1 - r) C_s + (theta'(T_s) w_s)^2)                  (3)
    d_s ~ N(0, tau^2)                                                               (4)

P_k are Legendre's polynomials of x = (T - T_ref) / h, so that no order changes what a
lower one says; T_ref and h are middle and half of the range. u is what all sessions
have in common, with D_s D_s = C_s: the same base, gravity and latitude are wrong alike
in each, move the constant alone, and leave differences between temperatures as sharp as
they are. d_s is what changes from run to run, w_s how far the temperature wandered
within a session. The order n, the size v, the share r and the spread tau are not known:
each set of them counts by its evidence,

    ln Z = -(y^T R^-1 y - b^T L M^-1 L b + ln |R| + ln |M|) / 2                     (5)
    M = I + L G L,   G = H^T R^-1 H,   b = H^T R^-1 y                               (6)

with H the columns of (1), R the covariance of d + e, and L the square roots of the
priors (2), (3); the answer is the mean over all sets, so that its ± holds whatever the
order is. Source: D. MacKay, Neural Computation 4, 415 (1992).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Legendre, Polynomial

from fieldcal.core.samples import Array
from fieldcal.thermal.curves import TERMS, ThermalCurve

SHARES = {0.0: 0.5, 0.3: 1 / 6, 0.7: 1 / 6, 0.95: 1 / 6}
"""r of (3) and its probability: as likely nothing in common as something."""

FALL = 2.0
"""Each order is so much smaller than the one below, (2)."""

ANY = 100.0
"""Prior of c_0 in what the sessions differ by."""


@dataclass(frozen=True, slots=True)
class GroupData:
    """Values of a group's p parameters in s sessions.

    Attributes
    ----------
    x : (s,) temperature over the range, -1 to 1
    y : (s, p) values less their mean `offset`, (p,)
    covariance : (s, p, p)
    wander : (s,) of the temperature, K
    tilt : (s, p) theta' of (3), per K

    """

    x: Array
    y: Array
    offset: Array
    covariance: Array
    wander: Array
    tilt: Array

    def tilted(self, tilt: Array) -> GroupData:
        """With another theta'."""
        return replace(self, tilt=tilt)

    def without(self, i: int) -> GroupData:
        """Without a session."""
        keep = np.arange(len(self.x)) != i
        some = (self.y, self.covariance, self.wander, self.tilt)
        y, covariance, wander, tilt = (part[keep] for part in some)
        return GroupData(self.x[keep], y, self.offset, covariance, wander, tilt)

    @property
    def columns(self) -> Array:
        """H of (1): orders by parameters, then what is common, (s, p, 5 p)."""
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
        diagonal = (self.tilt * self.wander[:, None]) ** 2 + spread[:, None, None] ** 2
        return own + diagonal[..., None] * np.eye(self.y.shape[1])


@dataclass(frozen=True, slots=True)
class GroupFit:
    """What all sets of n, v, r, tau say together.

    Attributes
    ----------
    weights : (m,) of the sets, sum 1
    sets : (m, 4)
    means : (m, 5 p) of c and u; `covariances` (m, 5 p, 5 p)
    offset : (p,) taken off before

    """

    weights: Array
    sets: Array
    means: Array
    covariances: Array
    offset: Array

    @property
    def mean(self) -> Array:
        """Of c and u, (5 p,)."""
        return np.asarray(self.weights @ self.means)

    @property
    def covariance(self) -> Array:
        """Of c and u, (5 p, 5 p): that of the sets, and how they differ."""
        off = self.means - self.mean
        within = np.einsum("m,mij->ij", self.weights, self.covariances)
        return np.asarray(within + np.einsum("m,mi,mj->ij", self.weights, off, off))

    def slopes(self, x: Array) -> Array:
        """Derivative of theta by x, (s, p)."""
        c = self.mean[: TERMS * len(self.offset)].reshape(TERMS, -1)
        derivative = np.polynomial.legendre.legder(c)
        return np.asarray(np.polynomial.legendre.legval(x, derivative).T)

    def curve(self, j: int, half: float, unit: str, held_out: Array) -> ThermalCurve:
        """The parameter numbered j in powers of kelvins."""
        p = len(self.offset)
        mine = np.arange(TERMS) * p + j
        to = _powers(half)
        a = to @ self.mean[mine]
        a[0] += self.offset[j]
        covariance = to @ self.covariance[np.ix_(mine, mine)] @ to.T
        orders = np.array([
            self.weights[self.sets[:, 0] == n].sum() for n in range(TERMS)
        ])  # fmt: skip
        spread = float(np.sqrt(self.weights @ self.sets[:, 3] ** 2))
        return ThermalCurve(unit, a, covariance, orders, spread, held_out)


def _powers(half: float) -> Array:
    """Matrix from coefficients of Legendre's polynomials of K / half to powers of K."""
    out = np.zeros((TERMS, TERMS))
    for k in range(TERMS):
        series: Array = np.asarray(Legendre.basis(k).convert(kind=Polynomial).coef)
        out[: k + 1, k] = series / half ** np.arange(k + 1)
    return out


def fitted(data: GroupData, sets: Array) -> GroupFit:
    """Mean, covariance and weight of each set, (5), (6)."""
    h, p = data.columns, data.y.shape[1]
    pairs, which = np.unique(sets[:, 2:], axis=0, return_inverse=True)
    noise = data.noise(*pairs.T)
    inverse = np.linalg.inv(noise)
    weighted = inverse @ h
    g = np.einsum("sia,msib->mab", h, weighted)[which]
    b = np.einsum("msia,si->ma", weighted, data.y)[which]
    square = np.einsum("si,msij,sj->m", data.y, inverse, data.y)
    log_noise = np.linalg.slogdet(noise)[1].sum(axis=1)
    root = _priors(
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


def _priors(sets: Array, p: int, wide: float) -> Array:
    """L of (6): square roots of the priors of c and u, (m, 5 p)."""
    k = np.arange(TERMS)
    order, size, share = sets[:, 0, None], sets[:, 1, None], sets[:, 2, None]
    terms = np.where(k <= order, size * FALL ** (1.0 - k), 0.0)
    terms[:, 0] = ANY * wide
    each = [np.repeat(terms, p, axis=1), np.repeat(np.sqrt(share), p, axis=1)]
    return np.concatenate(each, axis=1)


def missed(data: GroupData, sets: Array, i: int) -> Array:
    """Session i less what the others predict of it, in the ± of that, (p,)."""
    found = fitted(data.without(i), sets)
    h = data.columns[i]
    off = data.y[i] - found.means @ h.T
    noise = data.noise(sets[:, 2], sets[:, 3])[:, i]
    spread = np.einsum("pa,mab,pb->mp", h, found.covariances, h)
    spread += noise[:, np.arange(len(h)), np.arange(len(h))]
    mean = found.weights @ off
    variance = found.weights @ (spread + (off - mean) ** 2)
    return np.asarray(mean / np.sqrt(variance))
