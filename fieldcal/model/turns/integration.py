"""The attitude during a turn, integrated from the gyroscopes.

With the bias d and scale factor s of the model, w^ = (W - d)/s - w_earth, and steps of
dt,

    R_k = exp(-[w^ dt]x) R_{k-1},   u_k = sum_{j<=k} |w^ dt| / sum_j |w^ dt|

R_k transforms vectors from device axes at the start of the turn to device axes at step
k; u_k is the part of the turn that is completed, 0 to 1. Rates in rad/s. Source:
rotation kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import detections, resolutions
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.turns.attitude import interpolate_vectors
from fieldcal.model.turns.rotation import attitudes_from_rotations, small_turns
from fieldcal.physics.experience import Experience


@dataclass(frozen=True, slots=True)
class Leg:
    """One turn to be integrated, with the calibration from the windows.

    Attributes
    ----------
    source : samples
    x : inputs of the device in the rows of the windows
    bias, scale : (3,) of the gyroscopes
    delay : s by which the outputs of the gyroscopes are late
    pair : windows that the turn leads from and to
    first, last : the motion is in samples [first, last)

    """

    source: RowSource
    x: Experience
    bias: Array
    scale: Array
    delay: float
    pair: tuple[int, int]
    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Steps:
    """Samples of a turn, and the m fine steps that it is integrated in.

    Attributes
    ----------
    first : index in the recording of the first sample of the turn
    t : (n,) s, instants of the samples of the turn
    each : samples in a step
    edge : (m + 1,) indices in `t` of the edges of the steps
    cut : (k + 1,) indices in `edge` of the bounds of the pieces

    """

    first: int
    t: Array
    each: int
    edge: Index
    cut: Index

    @property
    def at(self) -> Array:
        """Instants of the edges, s."""
        return self.t[self.edge]


@dataclass(frozen=True, slots=True)
class IntegratedTurn:
    """An integrated turn.

    Attributes
    ----------
    rate, earth : (n, 3) rad/s at the samples: angular rate, and Earth's rate in it
    attitude : (m + 1, 3, 3) R at the edges
    done : (m + 1,) u at the edges

    """

    rate: Array
    earth: Array
    attitude: Array
    done: Array


def divide_into_steps(leg: Leg) -> Steps | None:
    """Steps of about 0.02 s and pieces of about 0.15 s.

    None if there are fewer than `detections.MIN_SAMPLES` steps.
    """
    block, first = leg.source.block, leg.first
    rate = leg.source.rate
    each = max(1, round(resolutions.INTEGRATION_STEP_S * rate))
    count = (leg.last - first - 1) // each
    if count < detections.MIN_SAMPLES:
        return None
    piece = max(
        1,
        round(resolutions.WAY_MEAN_S * rate / each),
        -(-count // resolutions.MAX_WAY_MEANS),
    )
    cut = np.append(np.arange(0, count - piece // 2, piece), count).astype(np.intp)
    t = block.t[first : first + count * each + 1]
    return Steps(first, t, each, np.arange(count + 1) * each, cut)


def integrate_turn(
    leg: Leg, steps: Steps, known_errors: Array, before: IntegratedTurn | None = None
) -> IntegratedTurn:
    """Integrate a turn.

    `known_errors` (m + 1, 3), rad/s at the edges, are subtracted from the outputs.
    `before` is the turn integrated with nearly the same ones: it carries the Earth's
    rate as well.
    """
    x, t, edge = leg.x, steps.t, steps.edge
    ends = [x.w[x.position == p].mean(axis=0) for p in leg.pair]
    rate = _angular_rates(leg, t, _interpolated(t, steps.at, known_errors))
    if before is None:
        # first with the Earth's rate interpolated in time, then carried by the attitude
        part = ((t - t[0]) / (t[-1] - t[0]))[:, None]
        earth, rounds = (1 - part) * ends[0] + part * ends[1], 2
    else:
        earth, rounds = before.earth, 1
    for _ in range(rounds):
        angle = small_turns(t, rate - earth, edge) / leg.source.pace
        size = np.concatenate([[0.0], np.cumsum(np.linalg.norm(angle, axis=1))])
        attitude, done = attitudes_from_rotations(angle), size / size[-1]
        earth = _interpolated(t, steps.at, interpolate_vectors(attitude, done, *ends))
    return IntegratedTurn(rate, earth, attitude, done)


def _interpolated(t: Array, at: Array, values: Array) -> Array:
    """Values (n, k) at instants t (n,), linear between those at instants `at`."""
    return np.column_stack([np.interp(t, at, column) for column in values.T])


def _angular_rates(leg: Leg, t: Array, known_errors: Array) -> Array:
    """Angular rate at instants t (n,), (n, 3) rad/s, corrected for the delay.

    `known_errors` (n, 3) rad/s are subtracted from the outputs.
    """
    block = leg.source.block
    first, n = int(np.searchsorted(block.t, t[0])), len(t)
    span = slice(max(first - n, 0), first + 2 * n)
    delayed = t + leg.delay
    measured = [np.interp(delayed, block.t[span], g) for g in block.gyr[span].T]
    return (np.stack(measured, axis=1) - leg.bias - known_errors) / leg.scale
