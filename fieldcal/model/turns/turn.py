"""One turn between two windows, integrated from the gyroscopes.

The turn leads from the window of position p to that of position q and takes the time T.
The gyroscopes have outputs W, bias d and scale factor s. The angular rate against the
Earth is w^ = (W - d)/s - w_earth, from which the other gyroscope errors of the state
are subtracted too. From it the attitude is integrated in steps k of dt,
R_k = exp(-[w^ dt]x) R_{k-1}; R_k takes vectors from device axes at p to device axes at
step k. If the outputs have an error dW, the true attitude is R (I + [phi]x) with

    phi_k = sum_{j<=k} R_j^T dW_j dt / s                                            (1)

phi_T is the closure of the turn. The accelerometers measure during the turn

    f_k = (1 - u) R_k f_p + u R_k R_T^T f_q + R_k ((phi_k - u phi_T) x f_p)          (2)

with f_p and f_q the specific forces in the windows and u the completed part of the
turn, 0 to 1. Rates in rad/s, phi in rad in device axes at p, f in m/s^2. Source:
rotation kinematics to first order in phi.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.derivative import derivative
from fieldcal.core.rotation import cross
from fieldcal.core.samples import Array, Index
from fieldcal.model.rows.reduce import Rows, RowSource
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.model.state import State
from fieldcal.model.turns.attitude import (
    accelerations,
    contradicts_force,
    first_row_of_each,
    interpolate_vectors,
    sampling_error,
    trapezoid_means,
    turn_geometry,
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
"""Smallest angle of a turn that is used, rad."""

PER_ROW = (
    "alpha", "beta", "gamma", "f", "w", "w_dot", "slope", "bend", "missed", "f_bend",
    "t", "lasts", "since_start", "since_turn", "warming", "heating", "variance",
    "position", "rate", "speed", "speed_sigma", "attitude_sigma", "alpha_axis",
)  # fmt: skip
"""Fields of `Experience` that have one value per row."""

MAX_CORRECTIONS = 3
"""Largest number of iterations of `other_gyro_errors`; each leaves 1 % of the error."""


@dataclass(frozen=True, slots=True)
class Turn:
    """One turn, in m fine steps between m + 1 edges, grouped into k pieces.

    Attributes
    ----------
    positions : p and q
    ends : inputs of the device in the rows of the windows
    x : inputs of the device at the edges, by the gyroscopes
    force_without_way_effects : (m + 1, 3) m/s^2, force at the edges without effects
        that act during turns only
    attitude : (m + 1, 3, 3) R at the edges
    done : (m + 1,) u at the edges
    cut : (k + 1,) indices of the edges that bound the pieces
    acc, sd : (k, 3) means of the accelerometers in the pieces, and their standard
        deviations by white noise, units of the output
    closure_sigma : rad, uncertainty of the closure by sampling and sway at its ends
    interval : s between samples
    standing_share : (m + 1, 3) share of the time about each edge in which each
        gyroscope keeps its output of the windows; None unless all windows share a
        rounding error
    rounding_covariance : (3, 3) rad^2, covariance of the closure from rounding while
        the outputs differ from those of the windows; None as above

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
        """The closure phi_T, (3,) rad in device axes at p."""
        return turn_geometry(self.ends, self.positions, self.attitude, self.done)[1]

    def means(self, values: Array) -> Array:
        """Means over the pieces, (k, ...), of values at the edges, (m + 1, ...).

        They are those that the trapezoid rule gives for samples `interval` apart. The
        difference of the rule with steps from edge to edge is removed by the next term
        of Euler and Maclaurin, -dt^2/12 (v'(b) - v'(a)).
        """
        t = self.x.t
        mean = trapezoid_means(t, values, self.cut)
        step = float(np.ptp(t)) / (len(t) - 1)
        slope = derivative(t, values)[self.cut]
        length = np.diff(t[self.cut]).reshape(-1, *[1] * (values.ndim - 1))
        mean_curvature: Array = np.diff(slope, axis=0) / length
        return mean - (step**2 - self.interval**2) / 12 * mean_curvature

    def weights(self, scale: Array) -> Array:
        """Weights (3, m + 1, 3) of (1), s: axes of the closure, edges, gyroscopes.

        `scale` (3,) are the scale factors of the gyroscopes.
        """
        steps = np.diff(self.x.t)
        seconds = np.zeros(len(self.x.t))  # that each edge stands for, trapezoid rule
        seconds[:-1] += steps / 2
        seconds[1:] += steps / 2
        out: Array = np.moveaxis(self.attitude, 2, 0) * seconds[:, None] / scale
        return out

    def attitude_error(self, rate_error: Array) -> Array:
        """Attitude errors phi - u phi_T at the edges, (m + 1, 3, k) rad.

        `rate_error` (m + 1, 3, k) are k courses of rate errors dW / s, rad/s.
        """
        at_start = np.einsum("mji,mjk->mik", self.attitude, rate_error)  # axes of p
        steps = np.diff(self.x.t)[:, None, None]
        phi = np.zeros_like(at_start)
        phi[1:] = np.cumsum((at_start[1:] + at_start[:-1]) / 2 * steps, axis=0)
        out: Array = phi - self.done[:, None, None] * phi[-1]
        return out

    def force_error(self, phi: Array) -> Array:
        """Force errors R (phi x f_p) at the edges, (m + 1, 3, k) m/s^2, (2).

        `phi` (m + 1, 3, k) are attitude errors, rad in device axes at p.
        """
        force = self.ends.f[self.ends.position == self.positions[0]].mean(axis=0)
        crossed = cross(np.moveaxis(phi, 1, 2), force)
        out: Array = np.einsum("mij,mkj->mik", self.attitude, crossed)
        return out


class TurnTracker:
    """Integrates the turns of a recording, from the usable samples.

    Parameters
    ----------
    source, rows : samples, and the rows of the windows
    since : (o, n) s since the turn in each row, by origin

    Attributes
    ----------
    legs : for each turn the windows (p, q), and the first and end sample of the motion
    sway_variances : rad^2, variance of a closure by sway at both ends, by (p, q)
    standing : gyroscope outputs that keep one value in the windows; None if none does
    contradicted_turns : pairs (p, q) for which the positions of the windows contradict
        the gyroscopes, by the state that the turns were integrated with last

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
        """Pairs of successive windows, with the motion between them in samples.

        None next to a window on a turning rate table, nor if a channel has no rows.
        """
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
        """Every turn that could be integrated with a state."""
        ends = state.experienced(self.rows.x)
        self.contradicted_turns = []
        for pair, first, last in self.legs:
            turn = self._turn(state, ends, pair, first, last)
            if turn is not None:
                sway_sigma = np.sqrt(self.sway_variances[pair])
                sigma = float(np.hypot(turn.closure_sigma, sway_sigma))
                yield replace(turn, closure_sigma=sigma)

    def _turn(
        self, state: State, ends: Experience, pair: tuple[int, int], a: int, b: int
    ) -> Turn | None:
        """Integrate a turn, corrected for the state's other gyroscope errors.

        `ends` are the inputs in the windows, `pair` the windows, and samples [a, b) the
        motion. None if the motion is too short, if the attitude at its end contradicts
        the position q, or if the device turned by less than `MIN_TURN_RAD`.
        """
        bias, scale, delay = state.bias[3:], state.scale[3:], state.lag.delay
        leg = Leg(self.source, ends, bias, scale, delay, pair, a, b)
        if (steps := divide_into_steps(leg)) is None:
            return None
        correction: Array = np.zeros((len(steps.edge), 3))
        for _ in range(MAX_CORRECTIONS):
            integrated = integrate_turn(leg, steps, correction)
            x = self._edges(ends, steps.at, pair, integrated, steps.edge)
            force_before_effects, x = x.f, apply_way_effects(x, state)
            before, correction = (
                correction,
                other_gyro_errors(state, x, self.time_since_turn(steps.at, pair[1])),
            )
            if np.abs(correction - before).max() * float(np.ptp(steps.at)) < 1e-6:
                break
        end = integrated.attitude[-1]
        if contradicts_force(ends, pair, end):
            self.contradicted_turns.append(pair)
            return None
        if np.arccos(np.clip((np.trace(end) - 1) / 2, -1, 1)) < MIN_TURN_RAD:
            return None
        noise = self.rows.noise[3:] / np.abs(state.scale[3:])
        sampling_sigma = sampling_error(
            steps.t, integrated.rate - integrated.earth, steps.each, noise
        )
        samples = slice(steps.first, steps.first + len(steps.t))
        cut = steps.cut
        acc = trapezoid_means(steps.t, self.source.block.acc[samples], steps.edge[cut])
        sd = self.rows.noise[:3] / np.sqrt(np.diff(steps.edge[cut]))[:, None]
        turn = Turn(
            pair, ends, x, force_before_effects, integrated.attitude, integrated.done,
            cut, acc, sd, sampling_sigma, 1 / self.source.rate,
        )  # fmt: skip
        if self.standing is None:
            return turn
        gyr, edge = self.source.block.gyr[samples], steps.edge
        return replace(
            turn,
            standing_share=self.standing.share(gyr, edge),
            rounding_covariance=self.standing.closure_covariance(
                steps.t, gyr, scale, edge, integrated.attitude
            ),
        )

    def time_since_turn(self, t: Array, q: int) -> Array:
        """Time (o, n), s, since the turn to window q at instants t (n,), by origin.

        inf before the end of the turn.
        """
        x = self.rows.x
        first_row = int(np.argmax(x.position == q))
        turn_end = x.t[first_row] - self.since[:, first_row]
        since = t - turn_end[:, None]
        out: Array = np.where(since >= 0, since, np.inf)
        return out

    def _edges(
        self,
        ends: Experience,
        t: Array,
        pair: tuple[int, int],
        integrated: IntegratedTurn,
        edge: Index,
    ) -> Experience:
        """Inputs of the device at the edges of the steps, by the gyroscopes.

        `t` (m + 1,) are the instants of the edges, `edge` their samples in the turn.
        """
        attitude, done = integrated.attitude, integrated.done
        f, _, _ = turn_geometry(ends, pair, attitude, done)
        w = integrated.rate[edge]
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
            alpha_axis=interpolate_vectors(attitude, done, *held[:, :, 2]),
        )  # fmt: skip
        return replace(out, w=w, w_dot=accelerations(t, w))


def _without_lost_samples(source: RowSource) -> RowSource:
    """The source with complete samples only, if some between windows are unusable."""
    unusable: NDArray[np.bool_] = ~np.all(source.usable, axis=1)
    for first, last in window_bounds(source.block, source.about):
        unusable[first:last] = False
    return source.complete_samples if unusable.any() else source


def select_rows(x: Experience, rows: Sequence[int]) -> Experience:
    """The rows of these indices."""
    selected: dict[str, Any] = {n: getattr(x, n)[list(rows)] for n in PER_ROW}
    return replace(x, **selected)


def concatenate_rows(parts: Sequence[Experience]) -> Experience:
    """Concatenate rows of one session."""
    joined: dict[str, Any] = {
        n: np.concatenate([getattr(x, n) for x in parts]) for n in PER_ROW
    }
    return replace(parts[0], **joined)


def apply_way_effects(x: Experience, state: State) -> Experience:
    """Inputs with the motion effects that act during turns."""
    for term in state.terms:
        if isinstance(term.effect, Motion) and term.effect.on_the_way:
            x = term.effect.change(x, term.values)
    return x


def other_gyro_errors(state: State, x: Experience, since: Array) -> Array:
    """Errors of the gyroscopes' outputs by the state's effects, (n, 3) rad/s.

    Bias, scale factor and delay are excluded: the integration itself corrects them.
    `since` (o, n) is the time since the turn, s, by origin.
    """
    terms = tuple(t for t in state.terms if not t.effect.lag(t.values).delay)
    outputs = replace(state, terms=terms).output(x, since)
    out: Array = outputs[:, 3:] - state.bias[3:] - state.scale[3:] * x.w
    return out
