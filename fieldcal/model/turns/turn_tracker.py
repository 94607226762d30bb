"""The turns of a recording, integrated with a state.

A turn begins and ends with the motion between two successive windows. Its rates are
corrected for the other errors of the gyroscopes, which depend on the motion that
follows from the rates.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Mask
from fieldcal.model import detections, tolerances
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.model.state import State
from fieldcal.model.turns.attitude import (
    accelerations,
    contradicts_force,
    first_row_of_each,
    interpolate_vectors,
    sampling_error,
    trapezoid_means,
)
from fieldcal.model.turns.integration import (
    IntegratedTurn,
    Leg,
    Steps,
    divide_into_steps,
    integrate_turn,
)
from fieldcal.model.turns.motion import motion_bounds
from fieldcal.model.turns.rounded import find_standing_outputs
from fieldcal.model.turns.tremor import sway_at_ends
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.effect import Motion
from fieldcal.physics.experience import Experience


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

        None next to a window on a turning rate table, or in which neither angles nor
        samples tell where the force points, nor if a channel has no rows.
        """
        rows, x = self.rows, self.rows.x
        if not rows.used.any(axis=0).all():
            return
        windows = window_bounds(self.source.block, self.source.about)
        held = np.unique(x.position)
        force_known = x.f[first_row_of_each(x, held)].any(axis=1)
        unusable = np.union1d(held[~force_known], x.position[x.rate.any(axis=1)])
        for p, q in zip(held[:-1].tolist(), held[1:].tolist(), strict=True):
            if np.isin((p, q), unusable).any():
                continue
            ends = int(windows[p, 1]), int(windows[q, 0])
            stretch = motion_bounds(self.source, rows, (p, q), *ends)
            if stretch is not None:
                yield (p, q), *stretch

    def turns(self, state: State) -> Iterator[Turn]:
        """Every turn that could be integrated with a state."""
        ends, delay = state.experienced(self.rows.x), state.lag.delay
        bias, scale = state.bias[3:], state.scale[3:]
        self.contradicted_turns = []
        for pair, *samples in self.legs:
            leg = Leg(self.source, ends, bias, scale, delay, pair, *samples)
            turn = self._turn(state, leg)
            if turn is not None:
                sway_sigma = np.sqrt(self.sway_variances[pair])
                sigma = float(np.hypot(turn.closure_sigma, sway_sigma))
                yield replace(turn, closure_sigma=sigma)

    def _turn(self, state: State, leg: Leg) -> Turn | None:
        """Integrate a turn, corrected for the state's other gyroscope errors.

        None if the motion is too short, if the attitude at its end contradicts the
        window that it leads to, or if the device turned by less than
        `detections.MIN_TURN_RAD`.
        """
        ends, pair = leg.x, leg.pair
        if (steps := divide_into_steps(leg)) is None:
            return None
        integrated, force_before_effects, x = self._corrected(leg, steps, state)
        end = integrated.attitude[-1]
        if contradicts_force(ends, pair, end):
            self.contradicted_turns.append(pair)
            return None
        if np.arccos(np.clip((np.trace(end) - 1) / 2, -1, 1)) < detections.MIN_TURN_RAD:
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
                steps.t, gyr, leg.scale, edge, integrated.attitude
            ),
        )

    def _corrected(
        self, leg: Leg, steps: Steps, state: State
    ) -> tuple[IntegratedTurn, Array, Experience]:
        """A turn integrated without the state's other gyroscope errors.

        With the force at its edges before the effects that act during turns, (m + 1,
        3), and the inputs there with them.
        """
        correction: Array = np.zeros((len(steps.edge), 3))
        rows = first_row_of_each(leg.x, leg.pair)
        forces, held = leg.x.f[rows], leg.x.to_device_in(rows)
        last: IntegratedTurn | None = None
        for _ in range(tolerances.MAX_CORRECTIONS):
            last = integrated = integrate_turn(leg, steps, correction, last)
            x = self._edges(leg, steps, integrated, forces, held)
            force_before_effects, x = x.f, apply_way_effects(x, state)
            before, since = correction, self.time_since_turn(steps.at, leg.pair[1])
            correction = other_gyro_errors(state, x, since)
            if np.abs(correction - before).max() * float(np.ptp(steps.at)) < 1e-6:
                break
        return integrated, force_before_effects, x

    def time_since_turn(self, t: Array, q: int) -> Array:
        """Time (o, n), s, since the turn to window q at instants t (n,), by origin.

        inf before the end of the turn.
        """
        x = self.rows.x
        first_row = int(np.argmax(x.position == q))
        turn_end = x.t[first_row] - self.since[:, first_row]
        since = t - turn_end[:, None]
        return np.where(since >= 0, since, np.inf)

    def _edges(
        self,
        leg: Leg,
        steps: Steps,
        integrated: IntegratedTurn,
        forces: Array,
        held: Array,
    ) -> Experience:
        """Inputs of the device at the edges of the steps, by the gyroscopes.

        `forces` (2, 3) and direction cosines `held` (2, 3, 3) are those in both
        positions.
        """
        ends, t = leg.x, steps.at
        attitude, done = integrated.attitude, integrated.done
        f = interpolate_vectors(attitude, done, *forces)
        w = integrated.rate[steps.edge]
        warming, heating = self.source.thermometer.at(t)
        unknown = np.full(len(t), np.nan)
        out = Experience.at_rest(
            unknown, unknown, ends.gravity, t=t,
            since_start=t - self.source.block.t[0],
            since_turn=np.full(len(t), np.inf), warming=warming, heating=heating,
            passed=self.source.passed.at(t),
            variance=np.full((len(t), 3), ends.variance.min(axis=0)),
            position=np.full(len(t), -1), mounting=ends.mounting,
            latitude=ends.latitude, f=f, joint_turns=ends.joint_turns,
            alpha_axis=interpolate_vectors(attitude, done, *held[:, :, 2]),
        )  # fmt: skip
        return replace(out, w=w, w_dot=accelerations(t, w))


def _without_lost_samples(source: RowSource) -> RowSource:
    """The source with complete samples only, if some between windows are unusable."""
    unusable: Mask = ~np.all(source.usable, axis=1)
    for first, last in window_bounds(source.block, source.about):
        unusable[first:last] = False
    return source.complete_samples if unusable.any() else source


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
    return outputs[:, 3:] - state.bias[3:] - state.scale[3:] * x.w
