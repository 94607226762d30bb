"""A window on a base that sways: its outputs as they would be with the base at rest.

The base (a ship at the pier, a vehicle on its springs, a mast in the wind) rotates by a
small vector phi(t), device axes, about its attitude at rest. With the specific force f0
at rest and the arm r from the centre of rotation, the device measures

    f - f0 = f0 x phi + phi x (phi x f0) / 2 + w' x r + w x (w x r)              (1)
    w      = phi' - phi x phi' / 2                                               (2)

The terms that are linear in phi are waves; their mean over a window depends only on its
ends. The mean of the terms of second order is not zero: phi^2 / 2 of gravity, and a
coning rate. The waves are
those of `sway_process`; the squares in (1) and (2) use the waves that the gyroscopes
measure.

Source: rotation kinematics to second order.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Mask
from fieldcal.windows.cells import CELL
from fieldcal.windows.sway_by_force import lean_angles, with_turn_rates
from fieldcal.windows.sway_process import fit_waves, wave_frequencies, without_waves
from fieldcal.windows.sway_waves import PERIODS, POINTS, SwayWaves

LOWEST, HIGHEST = 0.06, 1.5
"""Frequencies at which bases sway, Hz: a long swell, a stiff tripod."""

LONGEST_STRETCH_S = 40.0
"""Seconds that are evaluated together: longer windows are divided."""

FEWEST_CELLS = 16
"""Fewest cells that are evaluated."""

TYPICAL_ARM_M, SCALE_ERROR, LONGEST_ARM_M = 3.0, 0.02, 30.0
"""Typical arm r, m; typical error of scale factors; and the longest arm, m: at the
length of a pendulum of the same period the part of gravity does not show."""

LEAST_POWER_SHARE = 0.01
"""Part of the strongest wave's power below which a wave counts as noise."""

LEAST_ROTATION = float(np.deg2rad(0.1))
"""Least rotation that is evaluated, rad: a smaller one changes the mean of gravity by
less than 1e-5 m/s^2."""

MAX_UNEXPLAINED, MIN_UNEXPLAINED, MIN_POWER = 0.3, 1e-4, 1e-12
"""Largest and least unexplained power of the accelerometers across gravity, as parts of
the power that gravity has there by the rotation; and the least power, m^2/s^4."""

ROUNDS = 4
"""Fits of the arm, each with the noise left by the one before."""


def find_sway(t: Array, six: Array) -> list[SwayWaves]:
    """Look for swaying in a window.

    Parameters
    ----------
    t : (n,) s
    six : (n, 6) m/s^2 and rad/s, nan where missing; without gyroscopes the
        accelerometers tell it alone (`sway_by_force`)

    Returns
    -------
    Waves of each stretch of up to `LONGEST_STRETCH_S` s; empty if nothing sways.

    """
    channels = six if np.isfinite(six[:, 3:]).any() else six[:, :3]
    known: Mask = np.all(np.isfinite(channels), axis=1)
    t, six = (t, channels) if known.all() else (t[known], channels[known])
    parts = (
        max(1, int(np.ceil((t[-1] - t[0]) / LONGEST_STRETCH_S))) if len(t) > 1 else 1
    )
    if parts > len(t):  # samples minutes apart, or times in another unit
        return []
    out = []
    for own, some in zip(*(np.array_split(a, parts) for a in (t, six)), strict=True):
        waves = _waves_of_stretch(own, some)
        if waves is None:  # what sways does so throughout
            return []
        out.append(waves)
    return out


def _waves_of_stretch(t: Array, six: Array) -> SwayWaves | None:
    """Waves of one stretch; None if there are none, or if they are no rotation."""
    cells = _cells(t, six)
    if cells is None:
        return None
    at, y, length = cells
    span = float(at[-1] - at[0]) + length
    hz: Array = np.arange(1, int(2 * span * HIGHEST) + 1) / (2 * span)
    hz = hz[hz >= max(LOWEST, 1 / span)]
    force, ends = y[:, :3].mean(axis=0), (float(t[0]), float(t[-1]))
    alone = y.shape[1] == 3
    if not _oscillates(lean_angles(y, force) if alone else _turn_angle(y, length)):
        return None
    none = np.zeros(y.shape[1])
    plain = SwayWaves(
        hz[:0], float(at.mean()), y[:0], y[:0], force, none[:3], none, none, length,
        ends,
    )  # fmt: skip
    hz = wave_frequencies(at, y, hz, 1 / (8 * span))
    whole = with_turn_rates if alone else _fit_arm
    first = fit_waves(at, y, hz, plain)
    if first is None or not (waves := whole(first)):
        return None
    # the squares contain waves, part of which the first fit took for sway
    again = fit_waves(at, y - waves.second_order(at)[:, : y.shape[1]], hz, waves)
    if again is not None:
        waves = with_turn_rates(again) if alone else again
    return waves if waves.periods > PERIODS else None


def _cells(t: Array, six: Array) -> tuple[Array, Array, float] | None:
    """Middles and means (m, c) of complete cells, and their length, s."""
    if len(t) < FEWEST_CELLS:
        return None
    step = float(np.median(np.diff(t)))
    each = max(1, round(CELL / step))
    count = len(t) // each
    if count < FEWEST_CELLS:
        return None
    y = six[: count * each].reshape(count, each, -1).mean(axis=1)
    own = t[: count * each].reshape(count, each)
    whole = np.ptp(own, axis=1) < (each + 0.5) * step  # none across a gap
    if np.count_nonzero(whole) < FEWEST_CELLS:  # as of samples that come in bursts
        return None
    return own.mean(axis=1)[whole], y[whole], each * step


def _turn_angle(y: Array, length: float) -> Array:
    """Integral of the gyroscopes of cells (m, 6) less their mean, (m, 3) rad."""
    rate = y[:, 3:]
    angle: Array = np.cumsum((rate - rate.mean(axis=0)) * length, axis=0)
    return angle


def _oscillates(angle: Array) -> bool:
    """Whether the rotation (m, 3), rad, oscillates enough to be evaluated."""
    about = without_waves(np.arange(float(len(angle))), angle, ())
    return float((about**2).sum(axis=1).mean()) > LEAST_ROTATION**2 / 2


def _fit_arm(waves: SwayWaves) -> SwayWaves | None:
    """The waves with r of (1); None if accelerometers do not confirm the rotation."""
    t, strong = np.linspace(*waves.span, POINTS), _significant(waves)
    made = np.cross(waves.force, strong.turn_angle(t))
    speeding = strong.turn_angle(t, 2)
    design = np.stack([np.cross(speeding, e) for e in np.eye(3)] + [made], axis=2)
    design = design.reshape(-1, 4) * np.array(
        [TYPICAL_ARM_M, TYPICAL_ARM_M, TYPICAL_ARM_M, SCALE_ERROR]
    )
    power = float((made**2).sum())
    rest = (strong.linear(t)[:, :3] - made).ravel()
    known, amplitudes = np.zeros(4), 6 * len(strong.hz)
    for _ in range(ROUNDS):
        # the unexplained part is as smooth as the waves: count as many values
        missed = float(((rest - design @ known) ** 2).sum())
        noise = max(missed, MIN_UNEXPLAINED * power, MIN_POWER) / amplitudes
        known = np.linalg.solve(
            design.T @ design / noise + np.eye(4), design.T @ rest / noise
        )
    across = (rest - design @ known).reshape(-1, 3)  # a ship heaves as well
    across -= np.outer(across @ waves.force, waves.force) / (waves.force @ waves.force)
    arm = TYPICAL_ARM_M * known[:3]
    alike = float((across**2).sum()) < MAX_UNEXPLAINED * power
    return (
        replace(waves, arm=arm) if alike and np.abs(arm).max() < LONGEST_ARM_M else None
    )


def _significant(waves: SwayWaves) -> SwayWaves:
    """The waves above noise: second derivatives of fast noise would dominate."""
    pulse = 2 * np.pi * waves.hz
    power = (waves.cos[:, 3:] ** 2 + waves.sin[:, 3:] ** 2).sum(axis=1) / pulse**2
    kept = power > LEAST_POWER_SHARE * power.max()
    return replace(waves, hz=waves.hz[kept], cos=waves.cos[kept], sin=waves.sin[kept])
