"""What the gyroscopes say about each turn between two positions.

With bias and scale of the model, w^ = (W - d)/s - w_earth, the attitude is carried from
position p to position q: R_k = exp(-[w^ dt]x) R_{k-1}. If the gyroscopes' outputs are
off by dW, the true attitude is R (I + [phi]x) with

    phi_k = sum_{j<=k} R_j^T dW_j dt / s

At the end R must take the attitude (or, without known angles, the force) of p to that
of q: that is phi_T, the closure. On the way the accelerometers see

    f_k = (1 - u) R_k f_p + u R_k R_T^T f_q + R_k ((phi_k - u phi_T) x f_p)

u being the part of the turn that is done. Source: rotation kinematics to first order in
phi.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.attitude import (
    accelerations,
    astray,
    blur,
    geometry,
    trapezoid_means,
)
from fieldcal.diagnosis.course import NOTHING, Leg, Undo, divided, integrated
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.motion import moving
from fieldcal.diagnosis.reduce import Rows, Source, rate_of, spans
from fieldcal.effects import Experience
from fieldcal.samples import Array

LEAST = np.deg2rad(1.0)
"""A smaller turn says nothing."""


@dataclass(frozen=True, slots=True)
class Turn:
    """One turn, in m fine steps between m + 1 edges and k pieces.

    Attributes
    ----------
    positions : from, to
    x : what is experienced at the edges, as far as the gyroscopes tell
    attitude : (m + 1, 3, 3) R
    done : (m + 1,) u
    cut : (k + 1,) edges between the pieces
    acc, sd : (k, 3) means of the accelerometers in the pieces, and their white noise
    closure : (3,) rad, phi_T as seen
    blur : rad, what sampling leaves open of it
    rid : (m + 1, 3) rad/s, errors that the model has and the outputs were rid of
    across : (3, 3) projection on what of the closure is known
    start_force : (3,) f_p, m/s^2
    interval : s between the samples that `acc` is made of

    """

    positions: tuple[int, int]
    x: Experience
    attitude: Array
    done: Array
    cut: NDArray[np.intp]
    acc: Array
    sd: Array
    closure: Array
    across: Array
    start_force: Array
    interval: float
    blur: float
    rid: Array

    @property
    def t(self) -> Array:
        """Instants of the edges, s."""
        return self.x.t

    def means(self, values: Array) -> Array:
        """Means over the pieces of something known at the edges, (k, ...).

        As the trapezoid rule takes them from samples `interval` apart, by the next term
        of Euler and Maclaurin, -dt^2/12 (v'(b) - v'(a)).
        """
        mean = trapezoid_means(self.t, values, self.cut)
        step = float(self.t[1] - self.t[0])
        slope = np.gradient(values, self.t, axis=0)[self.cut]
        length = np.diff(self.t[self.cut]).reshape(-1, *[1] * (values.ndim - 1))
        bend: Array = np.diff(slope, axis=0) / length
        return mean - (step**2 - self.interval**2) / 12 * bend

    def carried(self, off: Array) -> tuple[Array, Array]:
        """Phi less its share of the closure at the edges, and the closure.

        `off` is dW/s, (m + 1, 3, k) rad/s; back come (m + 1, 3, k) and (3, k).
        """
        turned = np.einsum("mji,mjk->mik", self.attitude, off)
        gaps = np.diff(self.t)[:, None, None]
        phi = np.zeros_like(turned)
        phi[1:] = np.cumsum((turned[1:] + turned[:-1]) / 2 * gaps, axis=0)
        way: Array = phi - self.done[:, None, None] * phi[-1]
        return way, phi[-1]

    def swung(self, phi: Array) -> Array:
        """R (phi x f_p) at the edges, (m + 1, 3, k)."""
        force = np.broadcast_to(self.start_force, (len(phi), phi.shape[2], 3))
        crossed = np.cross(np.moveaxis(phi, 1, 2), force)
        out: Array = np.einsum("mij,mkj->mik", self.attitude, crossed)
        return out


def turns(source: Source, rows: Rows, fit: Fit, undo: Undo = NOTHING) -> list[Turn]:
    """Every turn between two windows that the gyroscopes have followed."""
    if not rows.used.any(axis=0).all():
        return []
    windows = spans(source.block, source.about)
    x = fit.state.experienced(rows.x)
    held = np.unique(x.position)
    found = []
    for p, q in zip(held[:-1].tolist(), held[1:].tolist(), strict=True):
        if x.rate[np.isin(x.position, (p, q))].any():
            continue
        stretch = moving(source, rows, (p, q), int(windows[p, 1]), int(windows[q, 0]))
        if stretch is None:
            continue
        leg = Leg(source, rows, fit, x, undo, (p, q), *stretch)
        if (made := _turn(leg, None)) is not None:
            found.append(_turn(leg, made) or made)
    return found


def errors_of(fit: Fit, x: Experience) -> Array:
    """What the model has wrong of the gyroscopes beside bias and scale, (n, 3)."""
    state = fit.state
    return state.output(x)[:, 3:] - state.bias[3:] - state.scale[3:] * x.w


def _turn(leg: Leg, before: Turn | None) -> Turn | None:
    """Follow a turn; the second time rid of what the model has wrong on the way."""
    source, rows, x, pair = leg.source, leg.rows, leg.x, leg.pair
    steps = divided(leg)
    if steps is None:
        return None
    rid: Array = np.zeros((len(steps.edge), 3))
    if before is not None:
        rid = errors_of(leg.fit, before.x)  # type: ignore[arg-type]
        if not rid.any():
            return before
    way = integrated(leg, steps, rid)
    if np.arccos(np.clip((np.trace(way.attitude[-1]) - 1) / 2, -1, 1)) < LEAST:
        return None
    if astray(x, pair, way.attitude[-1]):
        return None
    t, edge, cut = steps.t, steps.edge, steps.cut
    samples = slice(steps.first, steps.first + len(t))
    f, closure, across = geometry(x, pair, way.attitude, way.done)
    gyro_noise = rows.noise[3:] / abs(leg.fit.state.scale[3:])
    return Turn(
        pair,
        _edges(source, x, steps.at, f, way.rate[edge], pair[1]),
        way.attitude,
        way.done,
        cut,
        trapezoid_means(t, source.block.acc[samples], edge[cut]),
        rows.noise[:3] / np.sqrt(np.diff(edge[cut]))[:, None],
        closure,
        across,
        x.f[x.position == pair[0]].mean(axis=0),
        1 / rate_of(source.block),
        blur(t, way.rate - way.earth, steps.each, gyro_noise),
        rid,
    )


def _edges(
    source: Source, x: Experience, t: Array, f: Array, w: Array, q: int
) -> Experience:
    since = t - source.arrived[q]
    unknown = np.full(len(t), np.nan)
    warming, heating = source.warmth.at(t)
    out = Experience.at_rest(
        unknown,
        unknown,
        x.gravity,
        t=t,
        since_start=t - source.block.t[0],
        since_turn=np.where(since >= 0, since, np.inf),
        warming=warming,
        heating=heating,
        variance=np.full((len(t), 3), x.variance.min(axis=0)),
        position=np.full(len(t), -1),
        mounting=x.mounting,
        latitude=x.latitude,
        f=f,
    )
    return replace(out, w=w, w_dot=accelerations(t, w))
