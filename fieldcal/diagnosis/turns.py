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
    between,
    blur,
    carry,
    geometry,
    small_turns,
    trapezoid_means,
)
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.motion import moving
from fieldcal.diagnosis.reduce import Rows, Source, rate_of, spans
from fieldcal.effects import Experience
from fieldcal.samples import Array, Block

FINE_S = 0.02
"""Step of the integration at high sampling rates."""

PIECE_S = 0.15
"""Means of the accelerometers on the way."""

PIECES = 60
"""Of one turn at most."""

LEAST = np.deg2rad(1.0)


@dataclass(frozen=True, slots=True)
class Undo:
    """Gyroscope errors to be taken out before anything is integrated.

    Attributes
    ----------
    matrix : (3, 3) dW = matrix w
    delay : s by which the gyroscopes are late

    """

    matrix: Array
    delay: float

    def of(self, name: str) -> float:
        """Value by a parameter's full name, zero for what is not undone."""
        group, _, part = name.partition(".")
        if group == "gyro_scale":
            return float(self.matrix[int(part[1]) - 1, int(part[1]) - 1])
        if group == "gyro_cross_coupling":
            return float(self.matrix[int(part[1]) - 1, int(part[2]) - 1])
        return self.delay if group == "time_delay" else 0.0


NOTHING = Undo(np.zeros((3, 3)), 0.0)


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
        about = _About(source, rows, fit, x, undo, (p, q), *stretch)
        if (made := _turn(about, None)) is not None:
            found.append(_turn(about, made) or made)
    return found


def errors_of(fit: Fit, x: Experience) -> Array:
    """What the model has wrong of the gyroscopes beside bias and scale, (n, 3)."""
    state = fit.state
    return state.output(x)[:, 3:] - state.bias[3:] - state.scale[3:] * x.w


@dataclass(frozen=True, slots=True)
class _About:
    """One turn to be followed, by the model of the windows."""

    source: Source
    rows: Rows
    fit: Fit
    x: Experience
    undo: Undo
    pair: tuple[int, int]
    first: int
    last: int


def _turn(about: _About, before: Turn | None) -> Turn | None:
    """Follow a turn; the second time rid of what the model has wrong on the way."""
    source, rows, x, pair = about.source, about.rows, about.x, about.pair
    first, last = about.first, about.last
    block, rate = source.block, rate_of(source.block)
    each = max(1, round(FINE_S * rate))
    count = (last - first - 1) // each
    if count < 8:
        return None
    rows_p, rows_q = (x.position == p for p in pair)
    t = block.t[first : first + count * each + 1]
    edge = np.arange(count + 1) * each
    part = ((t - t[0]) / (t[-1] - t[0]))[:, None]
    ends = [x.w[at].mean(axis=0) for at in (rows_p, rows_q)]
    earth = (1 - part) * ends[0] + part * ends[1]
    rid: Array = np.zeros((len(edge), 3))
    if before is not None:
        rid = errors_of(about.fit, before.x)
        if not rid.any():
            return before
    inertial = _undone(block, about.fit, about.undo, t, _between(t, t[edge], rid))
    for _ in range(2):  # the Earth's rate turns with the device, once it is known how
        angle = small_turns(t, inertial - earth, edge) / source.pace
        size = np.concatenate([[0.0], np.cumsum(np.linalg.norm(angle, axis=1))])
        attitude, done = carry(angle), size / size[-1]
        there = between(attitude, done, *ends)
        earth = _between(t, t[edge], there)
    if np.arccos(np.clip((np.trace(attitude[-1]) - 1) / 2, -1, 1)) < LEAST:
        return None
    if astray(x, pair, attitude[-1]):
        return None
    each_piece = max(1, round(PIECE_S * rate / each), -(-count // PIECES))
    cut = np.append(np.arange(0, count - each_piece // 2, each_piece), count).astype(
        np.intp
    )
    acc = trapezoid_means(t, block.acc[first : first + len(t)], edge[cut])
    f, closure, across = geometry(x, pair, attitude, done)
    return Turn(
        pair,
        _edges(source, x, t[edge], f, inertial[edge], pair[1]),
        attitude,
        done,
        cut,
        acc,
        rows.noise[:3] / np.sqrt(np.diff(edge[cut]))[:, None],
        closure,
        across,
        x.f[rows_p].mean(axis=0),
        1 / rate,
        blur(
            t, inertial - earth, each, rows.noise[3:] / abs(about.fit.state.scale[3:])
        ),
        rid,
    )


def _between(t: Array, at: Array, values: Array) -> Array:
    """Columns of values given at some instants, straight between them, (n, k)."""
    return np.column_stack([np.interp(t, at, column) for column in values.T])


def _undone(block: Block, fit: Fit, undo: Undo, t: Array, rid: Array) -> Array:
    """Angular rate at some samples, (n, 3) rad/s."""
    first, n = int(np.searchsorted(block.t, t[0])), len(t)
    span = slice(max(first - n, 0), first + 2 * n)
    late = t + undo.delay
    seen = [np.interp(late, block.t[span], g) for g in block.gyr[span].T]
    response = np.diag(fit.state.scale[3:]) + undo.matrix
    rest = np.array(seen) - fit.state.bias[3:, None] - rid.T
    rate: Array = np.linalg.solve(response, rest).T
    return rate


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
