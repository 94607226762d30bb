"""One turn between two windows, integrated from the gyroscopes.

With w^ = (W - d)/s - w_earth, corrected also for the other errors of the gyroscopes in
the state, the attitude is integrated from position p to q, R_k = exp(-[w^ dt]x)
R_{k-1}. If the outputs have an error dW, the true attitude is R (I + [phi]x) with

    phi_k = sum_{j<=k} R_j^T dW_j dt / s                                            (1)

During the turn the accelerometers measure, with u the completed part of the turn,

    f_k = (1 - u) R_k f_p + u R_k R_T^T f_q + R_k ((phi_k - u phi_T) x f_p)          (2)

Source: rotation kinematics to first order in phi.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.derivative import derivative
from fieldcal.core.samples import Array, Index
from fieldcal.model.rows.reduce import Rows, RowSource
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.model.state import State
from fieldcal.model.turns.attitude import (
    accelerations,
    first_row_of_each,
    interpolate_vectors,
    sampling_error,
    trapezoid_means,
    turn_geometry,
    vertical_lost,
)
from fieldcal.model.turns.integration import (
    IntegratedTurn,
    Leg,
    divide_into_steps,
    integrate_turn,
)
from fieldcal.model.turns.motion import motion_bounds
from fieldcal.model.turns.rounded import find_standing_outputs
from fieldcal.model.turns.tremor import sway_at_ends
from fieldcal.physics.effect import Motion
from fieldcal.physics.experience import Experience

MIN_TURN_RAD = np.deg2rad(1.0)
"""Smaller turns are not used."""

PER_ROW = (
    "alpha", "beta", "gamma", "f", "w", "w_dot", "slope", "bend", "missed", "f_bend",
    "t", "lasts", "since_start", "since_turn", "warming", "heating", "variance",
    "position", "rate", "speed", "speed_sigma", "attitude_sigma", "alpha_axis",
)  # fmt: skip
"""Fields of `Experience` that have one value per row."""

MAX_CORRECTIONS = 3
"""Largest number of corrections for the gyroscopes' other errors; each leaves 1 %."""


@dataclass(frozen=True, slots=True)
class Turn:
    """One turn, in m fine steps between m + 1 edges and k pieces.

    Attributes
    ----------
    positions : from, to
    ends : inputs in the windows
    x : inputs at the edges, by the gyroscopes
    force_without_way_effects : (m + 1, 3) m/s^2, force at the edges without effects
        that act during turns only
    attitude : (m + 1, 3, 3) R
    done : (m + 1,) u
    cut : (k + 1,) edges between the pieces
    acc, sd : (k, 3) means of the accelerometers in the pieces, and their white noise
    closure_sigma : rad, uncertainty of the closure by sampling and sway at its ends
    interval : s between samples
    standing_share : (m + 1, 3) share of the time about the edges in which gyroscopes
        keep their values of the windows; None unless all windows share rounding errors
    rounding_covariance : (3, 3) rad^2, covariance of the closure from rounding at other
        values

    """

    positions: tuple[int, int]
    ends: Experience
    x: Experience
    force_without_way_effects: Array
    attitude: Array
    done: Array
    cut: Index
    acc: Array
    sd: Array
    closure_sigma: float
    interval: float
    standing_share: Array | None = None
    rounding_covariance: Array | None = None

    @property
    def t(self) -> Array:
        """Instants of the edges, s."""
        return self.x.t

    @property
    def closure(self) -> Array:
        """The closure phi_T, (3,) rad in the axes of p."""
        return turn_geometry(self.ends, self.positions, self.attitude, self.done)[1]

    def means(self, values: Array) -> Array:
        """Means over the pieces of values given at the edges, (k, ...).

        Equal to the trapezoid rule for samples `interval` apart, by the next term of
        Euler and Maclaurin, -dt^2/12 (v'(b) - v'(a)).
        """
        t = self.x.t
        mean = trapezoid_means(t, values, self.cut)
        step = float(np.ptp(t)) / (len(t) - 1)
        slope = derivative(t, values)[self.cut]
        length = np.diff(t[self.cut]).reshape(-1, *[1] * (values.ndim - 1))
        bend: Array = np.diff(slope, axis=0) / length
        return mean - (step**2 - self.interval**2) / 12 * bend

    def weights(self, scale: Array) -> Array:
        """Weights of the outputs at each edge in the closure, (3, m + 1, 3), (1)."""
        gaps = np.diff(self.x.t)
        each = np.zeros(len(self.x.t))
        each[:-1] += gaps / 2
        each[1:] += gaps / 2
        out: Array = np.moveaxis(self.attitude, 2, 0) * each[:, None] / scale
        return out

    def attitude_error(self, off: Array) -> Array:
        """Attitude error phi - u phi_T at the edges by rate errors, (m + 1, 3, k)."""
        turned = np.einsum("mji,mjk->mik", self.attitude, off)
        gaps = np.diff(self.x.t)[:, None, None]
        phi = np.zeros_like(turned)
        phi[1:] = np.cumsum((turned[1:] + turned[:-1]) / 2 * gaps, axis=0)
        way: Array = phi - self.done[:, None, None] * phi[-1]
        return way

    def force_error(self, phi: Array) -> Array:
        """Force error R (phi x f_p) at the edges, (m + 1, 3, k), (2)."""
        start = self.ends.f[self.ends.position == self.positions[0]].mean(axis=0)
        crossed = np.cross(np.moveaxis(phi, 1, 2), start)
        out: Array = np.einsum("mij,mkj->mik", self.attitude, crossed)
        return out


class TurnTracker:
    """Integrates the turns of a recording, from the usable samples.

    Parameters
    ----------
    source, rows : samples, and the windows' rows
    since : (o, n) s since the turn in each row, by origin

    Attributes
    ----------
    legs : the windows at both ends, and the bounds of the motion in samples
    sway_variances : rad^2, variance of sway in the windows at both ends
    contradicted_turns : pairs of windows whose positions contradict the gyroscopes, by
        the state that the turns were integrated with last

    """

    def __init__(self, source: RowSource, rows: Rows, since: Array) -> None:
        self.source, self.rows, self.since = _without_lost_samples(source), rows, since
        self.legs = list(self._find_turns())
        windows = window_bounds(source.block, source.about)
        self.sway_variances = {
            pair: sway_at_ends(source, windows[[*pair]]) for pair, *_ in self.legs
        }
        self.standing = find_standing_outputs(
            source.block, windows, rows.session_error[3:]
        )
        self.contradicted_turns: list[tuple[int, int]] = []

    def _find_turns(self) -> Iterator[tuple[tuple[int, int], int, int]]:
        rows, x = self.rows, self.rows.x
        if not rows.used.any(axis=0).all():
            return
        windows, held = (
            window_bounds(self.source.block, self.source.about),
            np.unique(x.position),
        )
        for p, q in zip(held[:-1].tolist(), held[1:].tolist(), strict=True):
            if x.rate[np.isin(x.position, (p, q))].any():
                continue
            ends = int(windows[p, 1]), int(windows[q, 0])
            stretch = motion_bounds(self.source, rows, (p, q), *ends)
            if stretch is not None:
                yield (p, q), *stretch

    def turns(self, state: State) -> Iterator[Turn]:
        """Every turn, integrated with a state."""
        ends = state.experienced(self.rows.x)
        self.contradicted_turns = []
        for pair, first, last in self.legs:
            turn = self._turn(state, ends, pair, first, last)
            if turn is not None:
                swayed = float(
                    np.hypot(turn.closure_sigma, np.sqrt(self.sway_variances[pair]))
                )
                yield replace(turn, closure_sigma=swayed)

    def _turn(
        self, state: State, ends: Experience, pair: tuple[int, int], a: int, b: int
    ) -> Turn | None:
        """Integrate a turn, corrected for the state's other gyroscope errors."""
        bias, scale, late = state.bias[3:], state.scale[3:], state.lag.delay
        leg = Leg(self.source, ends, bias, scale, late, pair, a, b)
        if (steps := divide_into_steps(leg)) is None:
            return None
        correction: Array = np.zeros((len(steps.edge), 3))
        for _ in range(MAX_CORRECTIONS):
            way = integrate_turn(leg, steps, correction)
            x = self._edges(ends, steps.at, pair, way, steps.edge)
            force_before_effects, x = x.f, apply_way_effects(x, state)
            before, correction = (
                correction,
                other_gyro_errors(state, x, self.time_since_turn(steps.at, pair[1])),
            )
            if np.abs(correction - before).max() * float(np.ptp(steps.at)) < 1e-6:
                break
        end = way.attitude[-1]
        if vertical_lost(ends, pair, end):
            self.contradicted_turns.append(pair)
            return None
        if np.arccos(np.clip((np.trace(end) - 1) / 2, -1, 1)) < MIN_TURN_RAD:
            return None
        noise = self.rows.noise[3:] / np.abs(state.scale[3:])
        sampling_sigma = sampling_error(
            steps.t, way.rate - way.earth, steps.each, noise
        )
        samples = slice(steps.first, steps.first + len(steps.t))
        cut = steps.cut
        acc = trapezoid_means(steps.t, self.source.block.acc[samples], steps.edge[cut])
        sd = self.rows.noise[:3] / np.sqrt(np.diff(steps.edge[cut]))[:, None]
        turn = Turn(
            pair, ends, x, force_before_effects, way.attitude, way.done, cut, acc, sd,
            sampling_sigma,
            1 / self.source.rate,
        )  # fmt: skip
        if self.standing is None:
            return turn
        gyr, edge = self.source.block.gyr[samples], steps.edge
        return replace(
            turn,
            standing_share=self.standing.share(gyr, edge),
            rounding_covariance=self.standing.closure_covariance(
                steps.t, gyr, scale, edge, way.attitude
            ),
        )

    def time_since_turn(self, t: Array, q: int) -> Array:
        """Time since the turn at instants t, (o, n) by origin; inf before its end."""
        x = self.rows.x
        at = int(np.argmax(x.position == q))
        arrived = x.t[at] - self.since[:, at]
        since = t - arrived[:, None]
        out: Array = np.where(since >= 0, since, np.inf)
        return out

    def _edges(
        self,
        ends: Experience,
        t: Array,
        pair: tuple[int, int],
        way: IntegratedTurn,
        edge: Index,
    ) -> Experience:
        """Inputs at the edges of the steps, by the gyroscopes."""
        f, _, _ = turn_geometry(ends, pair, way.attitude, way.done)
        w = way.rate[edge]
        held = ends.to_device[first_row_of_each(ends, pair)]
        warming, heating = self.source.thermometer.at(t)
        unknown = np.full(len(t), np.nan)
        out = Experience.at_rest(
            unknown, unknown, ends.gravity, t=t,
            since_start=t - self.source.block.t[0],
            since_turn=np.full(len(t), np.inf), warming=warming, heating=heating,
            variance=np.full((len(t), 3), ends.variance.min(axis=0)),
            position=np.full(len(t), -1), mounting=ends.mounting,
            latitude=ends.latitude, f=f, joint_turns=ends.joint_turns,
            alpha_axis=interpolate_vectors(way.attitude, way.done, *held[:, :, 2]),
        )  # fmt: skip
        return replace(out, w=w, w_dot=accelerations(t, w))


def _without_lost_samples(source: RowSource) -> RowSource:
    """The source, without unusable samples if any lie between windows."""
    lost: NDArray[np.bool_] = ~np.all(source.usable, axis=1)
    for first, last in window_bounds(source.block, source.about):
        lost[first:last] = False
    return source.complete_samples if lost.any() else source


def select_rows(x: Experience, rows: Sequence[int]) -> Experience:
    """Some rows of an experience."""
    selected: dict[str, Any] = {n: getattr(x, n)[list(rows)] for n in PER_ROW}
    return replace(x, **selected)


def concatenate_rows(parts: Sequence[Experience]) -> Experience:
    """Concatenate rows of one session."""
    every: dict[str, Any] = {
        n: np.concatenate([getattr(x, n) for x in parts]) for n in PER_ROW
    }
    return replace(parts[0], **every)


def apply_way_effects(x: Experience, state: State) -> Experience:
    """Inputs with the motion effects that act during turns."""
    for term in state.terms:
        if isinstance(term.effect, Motion) and term.effect.on_the_way:
            x = term.effect.change(x, term.values)
    return x


def other_gyro_errors(state: State, x: Experience, since: Array) -> Array:
    """Errors of the gyroscopes in the state beside bias, scale and delay, (n, 3)."""
    terms = tuple(t for t in state.terms if not t.effect.lag(t.values).delay)
    off = replace(state, terms=terms).output(x, since)
    out: Array = off[:, 3:] - state.bias[3:] - state.scale[3:] * x.w
    return out
