"""Hand tremor: a device that is held by hand rotates slightly all the time.

If orientations are not known, only the norm of the force determines the accelerometers.
On a table the direction of the force is constant within the noise of the rows. In a
hand it varies, which would look like a bias that varies. Each window is then a single
row, since the norm of the mean force changes only to second order in the angle. The
mean rate over T s is the difference of the angles at both ends over T. If the angle
varies by a (rms), the error of the mean rate is

    sqrt(k) a / T                                                                  (1)

with k of `hand_drift`: 2 if the hand does not turn slowly as well.

The accelerometers show the slow part of the tremor, in all windows together. The
gyroscopes show in which windows and about which axes the tremor is larger: the
integrated rate has about a straight line the variance

    a^2 + N^2 T / 15                                                               (2)

with N the density of the white noise, whose integral is a random walk. Tremor is motion
and not noise of the sensors: the gyroscopes follow it from one rest to the next, and
the angle that it has reached at the end of a rest changes the closure of a turn. The
hand also accelerates the device. Along gravity the integral of this is a speed that
returns to zero as the angle does, so (1), with k of 2, and (2) hold with the speed for
the mean force along gravity.

On a table that trembles the gyroscopes show (2), and the direction of the force stays:
they have single rows, and the accelerometers their blocks.

Somebody may hold the device in some windows only, and lean it against something, put it
down or into a fixture in the others. The noise of the sensors is the same in all of
them: over a second, (2) without a hand varies by a few tenths, and a hand makes it some
ten times as large. Angles that are known are then off by what the hand turns. Windows
without a hand keep their blocks: a jump or a knock within them is seen as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import GYR, Array, Index
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.block_means import masked
from fieldcal.model.rows.hand_drift import (
    STEADY_HAND_K,
    ForceTurn,
    drift_factor,
    force_turn_rate,
)
from fieldcal.model.rows.means import median_sigma
from fieldcal.model.rows.noise import rounding_noise
from fieldcal.model.rows.reduce import reduce_to_rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.windows.noise import is_to_and_fro, quickest_noise

WANDER_SIGMAS = 6.0
"""Standard deviations of what the squares across the force have too many."""

MIN_HELD_WINDOWS = 4
"""Windows of a device in a hand; what lies still for long drifts by itself."""

ACROSS_RATIO = 1.5
"""And by how much more than along the force."""

PUSHED_NOISE_RATIO = 1.5
"""Times their quickest noise that accelerometers show where a hand pushes the device:
on a table that trembles 1.3 at most in published recordings."""

MIN_QUIET_SHARE = 0.25
"""Share of the windows that show no more than the sensors' own noise."""

LYING_NOISE_RATIO = 3.0
"""Times that noise which one shows in which the device lies still: in published
recordings 2 at most on a table, 4 to 60 in a hand."""


def rows_of_recording(source: RowSource) -> Rows:
    """Rows of a recording, one for each window in which the device is held by hand."""
    rows = reduce_to_rows(source)
    held = np.unique(rows.x.position)
    windows = window_bounds(source.block, source.about)
    bound = windows[held]
    block = masked(source.block, source.usable)
    six = block.six
    pieces = [six[a:b] for a, b in bound]
    angle, noise = (
        force_wander_angle(rows),
        _noise_beside_tremor(rows, pieces, rounding_noise(block, bound)),
    )
    if angle or noise is not None:
        in_hand = _add_hand_motion(
            source, reduce_to_rows(source, whole=True, level=noise), angle
        )
        pushed = (rows.noise[:3] > PUSHED_NOISE_RATIO * in_hand.noise[:3]).any()
        return in_hand if angle or pushed else _separate_triads(source, in_hand)
    trembling = _trembling_windows(rows, pieces, source.rate)
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

    Parameters
    ----------
    source, rows : the samples and their rows
    angle : least rms angle by which the hand turns the force, rad
    held : (k,) the rows of windows in a hand; all of them if None

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
    slow = np.sqrt(STEADY_HAND_K * angle**2 + k * turned**2) / length[:, None]  # (1)
    sd[held, 3:] = np.hypot(sd[held, 3:], slow * rate_unit)
    fast = np.sqrt(STEADY_HAND_K) * (pushed / length)[:, None] * unit  # (1)
    sd[held, :3] = np.hypot(sd[held, :3], fast)
    # difference between the angle at the end of a rest and the mean angle
    some, wander = np.where(known, square, trembles[:, None]), np.zeros_like(sd[:, 3:])
    wander[held] = np.sqrt(np.maximum(angle**2, k / STEADY_HAND_K * some))
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
        turned[i] = _tremor_rms(rates, lasts, white[3:] / rate_unit)
        size = np.linalg.norm(rows.x.f[row]) or np.nan  # of gyroscopes alone
        up, force = rows.x.f[row] / size, block.acc[a:b] / unit
        spread = np.array([np.linalg.norm(white[:3] / unit * up)])
        pushed[i] = _tremor_rms((force @ up)[:, None], lasts, spread)[0]
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
    out: Array = across.T @ across
    return out


def _trembling_windows(
    rows: Rows, pieces: list[Array], rate: float
) -> NDArray[np.bool_]:
    """Windows in which a hand moves the device, while it rests in others, (k,).

    `pieces` are the (n_i, 6) samples of each, nan where missing, at `rate` Hz.
    """
    if len(pieces) < MIN_HELD_WINDOWS:
        return np.zeros(len(pieces), dtype=bool)
    shown = np.array([_relative_tremor(piece[:, GYR], rate) for piece in pieces])
    known = np.isfinite(shown).all(axis=0) & (shown > 0).all(axis=0)
    if not known.any():
        return np.zeros(len(pieces), dtype=bool)
    sensors = np.quantile(shown[:, known], MIN_QUIET_SHARE, axis=0)
    apart: NDArray[np.bool_] = (shown[:, known] / sensors).mean(
        axis=1
    ) > LYING_NOISE_RATIO
    return apart


def _relative_tremor(rates: Array, rate: float) -> Array:
    """Variance (2) over a second, relative to that of white noise alone, (3,).

    nan for an axis without noise or without samples.
    """
    noise = _high_frequency_noise(rates)
    measured, unrest = np.isfinite(noise), np.full(3, np.nan)
    if not measured.any():
        return unrest
    many = min(len(rates), max(round(rate), 8))
    white = noise[measured] ** 2 / rate * (many / rate) / 15
    parts = np.array_split(rates[:, measured], len(rates) // many)
    nothing = np.zeros(len(white))
    turned = [_tremor_rms(part, len(part) / rate, nothing) ** 2 for part in parts]
    # a hand does so all the time, and a bump in a second or two
    usual = np.median(turned, axis=0)
    unrest[measured] = usual / np.where(white > 0, white, np.nan)
    return unrest


def _high_frequency_noise(rates: Array) -> Array:
    """Standard deviation of the high-frequency noise of one sample, (3,).

    nan for an axis without samples.
    """
    out = np.full(3, np.nan)
    measured = np.isfinite(np.diff(rates, 4, axis=0)).any(axis=0)
    if measured.any():
        out[measured] = quickest_noise([rates[:, measured]])
    return out


def _noise_beside_tremor(rows: Rows, pieces: list[Array], least: Array) -> Array | None:
    """Noise of one sample without the tremor, (6,); None if there is no tremor.

    `pieces` are the (n_i, 6) samples of windows, `least` (6,) the noise of rounding.
    """
    free = ~rows.x.oriented.any() and len(pieces) >= MIN_HELD_WINDOWS
    if not free or not is_to_and_fro([piece[:, GYR] for piece in pieces]):
        return None
    # where a hand is quick, differences of samples show it as well
    each = np.ma.masked_invalid(
        [_high_frequency_noise(piece[:, GYR]) for piece in pieces]
    )
    loud = (each / each.mean(axis=0)).mean(axis=1).filled(np.inf)
    quiet = np.argsort(loud)[: max(round(MIN_QUIET_SHARE * len(pieces)), 1)]
    beside: Array = np.fmax(quickest_noise([pieces[i] for i in quiet]), least)
    return beside


def _tremor_rms(values: Array, length: float, white: Array) -> Array:
    """Rms of the integrated outputs, an angle or a speed, about a line, (k,).

    Parameters
    ----------
    values : (n, k) outputs, nan where missing
    length : T, s
    white : (k,) deviation of the mean by white noise, N / sqrt(T)

    """
    known = np.isfinite(values)
    mean = np.nan_to_num(values).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    off = np.where(known, values - mean, 0.0)
    total = np.cumsum(off, axis=0) * (length / len(off))
    part = np.linspace(-1.0, 1.0, len(off))
    line = np.linalg.qr(np.column_stack([np.ones_like(part), part]))[0]
    total -= line @ (line.T @ total)
    noise = (white * length) ** 2 / 15
    out: Array = np.sqrt(np.maximum((total**2).mean(axis=0) - noise, 0.0))  # (2)
    return out


def force_wander_angle(rows: Rows) -> float:
    """Rms angle by which the force turns within windows, rad; 0 on a table.

    A course that all windows share is subtracted: outputs that settle make one.
    """
    x, usable = rows.x, rows.used[:, :3].all(axis=1) & ~rows.x.oriented
    held = [usable & (x.position == p) for p in np.unique(x.position[usable])]
    held = [at for at in held if at.sum() > 1]
    if len(held) < MIN_HELD_WINDOWS:
        return 0.0
    offs = [rows.y[at, :3] - rows.y[at, :3].mean(axis=0) for at in held]
    along, across, dof, angle = 0.0, 0.0, 0.0, []
    for at, off in zip(held, _without_shared_course(offs), strict=True):
        up = x.f[at][0] / np.linalg.norm(x.f[at][0])
        sd = rows.sd[at, :3]
        part = np.outer(off @ up, up)
        free = (len(off) - 1) * (1 - 1 / len(held))
        along += float(((part / sd) ** 2).sum())
        across += float((((off - part) / sd) ** 2).sum())
        dof += free
        length = np.linalg.norm(rows.y[at, :3].mean(axis=0))
        angle.append(((off - part) ** 2).sum() / (2 * free) / length**2)
    if across / 2 < max(dof + WANDER_SIGMAS * np.sqrt(dof), ACROSS_RATIO * along):
        return 0.0
    return float(np.sqrt(np.mean(angle)))


def _without_shared_course(offs: list[Array]) -> list[Array]:
    """Courses within windows, (n, 3) each, less their median course."""
    longest = max(map(len, offs))
    whole = np.full((len(offs), longest, 3), np.nan)
    for i, off in enumerate(offs):
        whole[i, : len(off)] = off
    shared = np.nanmedian(whole, axis=0)
    return [off - shared[: len(off)] for off in offs]
