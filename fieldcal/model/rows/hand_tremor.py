"""Hand tremor: a device that is held by hand rotates slightly all the time.

If orientations are not known, only the norm of the force determines the accelerometers.
On a table the direction of the force is constant within the noise of the rows. In a
hand it varies, which would look like a bias that varies. Each window is then a single
row, since the norm of the mean force changes only to second order in the angle. The
mean rate over T s is the difference of the angles at both ends over T. If the angle
varies by a (rms), the error of the mean rate is

    sqrt(k) a / T                                                                  (1)

with k of `hand_drift`: 2 if the hand does not turn slowly as well.

`hand_detection` shows in which windows and about which axes that is. Tremor is motion
and not noise of the sensors: the gyroscopes follow it from one rest to the next, and
the angle that it has reached at the end of a rest changes the closure of a turn. The
hand also accelerates the device. Along gravity the integral of this is a speed that
returns to zero as the angle does, so (1), with k of 2, holds with the speed for the
mean force along gravity.

On a table that trembles the gyroscopes show it, and the direction of the force stays:
they have single rows, and the accelerometers their blocks.

Somebody may hold the device in some windows only, and lean it against something, put it
down or into a fixture in the others. Angles that are known are then off by what the
hand turns. Windows without a hand keep their blocks: a jump or a knock within them is
seen as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import detections, priors
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.block_means import masked
from fieldcal.model.rows.hand_detection import (
    force_wander_angle,
    noise_beside_tremor,
    trembling_windows,
    tremor_rms,
)
from fieldcal.model.rows.hand_drift import ForceTurn, drift_factor, force_turn_rate
from fieldcal.model.rows.noise import rounding_noise
from fieldcal.model.rows.reduce import median_sigma, reduce_to_rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.window_bounds import window_bounds


def rows_of_recording(source: RowSource) -> Rows:
    """Rows of a recording, one for each window in which the device is held by hand."""
    rows = reduce_to_rows(source)
    held = np.unique(rows.x.position)
    windows = window_bounds(source.block, source.about)
    bound = windows[held]
    block = masked(source.block, source.usable)
    pieces = [block[a:b] for a, b in bound]
    trembling = trembling_windows(rows, pieces, source.rate)
    angle = force_wander_angle(rows, bool(trembling.any()))
    rounded = rounding_noise(block, bound).max(axis=0)
    noise = noise_beside_tremor(rows, pieces, rounded)
    if angle or noise is not None:
        in_hand = _add_hand_motion(
            source, reduce_to_rows(source, whole=True, level=noise), angle
        )
        pushed = (rows.noise[:3] > detections.HELD_RATIO * in_hand.noise[:3]).any()
        return in_hand if angle or pushed else _separate_triads(source, in_hand)
    if not trembling.any():
        return rows
    shaky = np.isin(np.arange(len(windows)), held[trembling])
    still = rows.without(shaky[rows.x.position])
    level = still.sd * np.sqrt(rows.length * source.rate)[:, None]
    in_hand = reduce_to_rows(source, whole=shaky, level=median_sigma(level))
    at = np.flatnonzero(shaky[in_hand.x.position])
    unsteady = _add_hand_motion(source, replace(in_hand, noise=rows.noise), 0.0, at)
    return _add_angle_errors(source, unsteady, at)


def _add_hand_motion(
    source: RowSource, rows: Rows, angle: float, held: Index | None = None
) -> Rows:
    """Add the errors of the means by a hand's motion to rows of whole windows.

    `angle` is the least rms angle by which the hand turns the force, rad; `held` (k,)
    are the rows of windows in a hand, all of them if None.
    """
    held = np.arange(len(rows.x)) if held is None else held
    turned, pushed, turns = _motion_in_hand(source, rows, held)
    nominal = source.about.nominal
    unit, rate_unit = (np.abs(nominal[name]) for name in ("acc_scale", "gyr_scale"))
    sd, length = rows.sd.copy(), rows.length[held]
    # an axis without information has the mean of the others
    known = np.isfinite(turned)
    square = np.where(known, turned, 0.0) ** 2
    trembles = square.sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    k = drift_factor(turns, trembles / length**2)
    slow = (
        np.sqrt(priors.STEADY_HAND_K * angle**2 + k * turned**2) / length[:, None]
    )  # (1)
    sd[held, 3:] = np.hypot(sd[held, 3:], slow * rate_unit)
    fast = np.sqrt(priors.STEADY_HAND_K) * (pushed / length)[:, None] * unit  # (1)
    sd[held, :3] = np.hypot(sd[held, :3], fast)
    # difference between the angle at the end of a rest and the mean angle
    some, wander = np.where(known, square, trembles[:, None]), np.zeros_like(sd[:, 3:])
    wander[held] = np.sqrt(np.maximum(angle**2, k / priors.STEADY_HAND_K * some))
    return replace(rows, sd=sd, hand_angle=wander)


def _motion_in_hand(
    source: RowSource, rows: Rows, held: Index
) -> tuple[Array, Array, list[ForceTurn]]:
    """Tremor about each axis (k, 3), rad, along the force (k,), m/s, and slow turns."""
    block = masked(source.block, source.usable)
    nominal = source.about.nominal
    unit, rate_unit = (np.abs(nominal[name]) for name in ("acc_scale", "gyr_scale"))
    turned, pushed, turns = np.zeros((len(held), 3)), np.zeros(len(held)), []
    bound = window_bounds(source.block, source.about)[rows.x.position[held]]
    for i, (row, (a, b)) in enumerate(zip(held.tolist(), bound, strict=True)):
        white, lasts = rows.sd[row], float(rows.length[row])
        rates = block.gyr[a:b] / rate_unit
        turned[i] = tremor_rms(rates, lasts, white[3:] / rate_unit)
        size = np.linalg.norm(rows.x.f[row]) or np.nan  # of gyroscopes alone
        up, force = rows.x.f[row] / size, block.acc[a:b] / unit
        spread = np.array([np.linalg.norm(white[:3] / unit * up)])
        pushed[i] = tremor_rms((force @ up)[:, None], lasts, spread)[0]
        turns.append(force_turn_rate(force, lasts))
    return turned, pushed, turns


def _separate_triads(source: RowSource, in_hand: Rows) -> Rows:
    """Rows with blocks for the accelerometers, and whole windows for the gyroscopes.

    The latter are those of `in_hand`. For a table that trembles without turning the
    force.
    """
    rows = reduce_to_rows(source, apart=True)
    count = np.unique(rows.x.position, return_counts=True)[1]
    ends, sd = np.cumsum(count) - 1, rows.sd.copy()
    sd[ends, 3:] = in_hand.sd[:, 3:]
    wander = np.repeat(in_hand.hand_angle, count, axis=0)
    return replace(rows, sd=sd, noise=in_hand.noise, hand_angle=wander)


def _add_angle_errors(source: RowSource, rows: Rows, held: Index) -> Rows:
    """Add the angle errors by a hand in rows `held` whose angles are known."""
    x, sd = rows.x, rows.sd.copy()
    for i in held[x.oriented[held]]:
        off = np.sqrt(np.diag(turned_force(x.f[i], rows.hand_angle[i])))
        sd[i, :3] = np.hypot(sd[i, :3], off * np.abs(source.about.nominal["acc_scale"]))
    return replace(rows, sd=sd)


def turned_force(force: Array, angle: Array) -> Array:
    """Covariance of a force (3,) that is turned at random about three axes, (3, 3).

    `angle` is the standard deviation about each, (3,) rad.
    """
    across = np.cross(np.eye(3), force) * angle[:, None]
    return across.T @ across
