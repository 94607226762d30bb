"""Play a session again on a virtual device: its windows, with turns in the gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block, concat
from fieldcal.sim_device.device import PIECE, Sensing
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.temperature import recorded_climate
from fieldcal.sim_device.way import Manoeuvre

SHARE = 0.6
"""A turn takes at most so much of the gap that it lies in."""

TAIL_S = 3.0
"""Samples go on for so long after the last window, s."""

LONGEST_GAP = 100_000
"""Ticks of the clock that slow noise runs through where samples are missing."""


@dataclass(frozen=True, slots=True)
class HeldWindow:
    """A stretch in which the device is held, or spun at a constant rate.

    Attributes
    ----------
    alpha, beta : where it is held, rad; on a rate table, where it starts from
    start, end : s of device time
    rate : about procedure axes, rad/s
    turn : when the turn that leads here starts and ends, s; None: amid the gap
    vibration : rms, m/s^2; None: as the profile has it
    way : the device is carried along to here, in device time; None: the joints turn
    gamma : third angle, rad

    """

    alpha: float
    beta: float
    start: float
    end: float
    rate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float] | None = None
    vibration: float | None = None
    way: Manoeuvre | None = None
    gamma: float = 0.0


Schedule = Sequence[HeldWindow] | Sequence[tuple[float, float, float, float]]


def simulate(
    profile: Profile,
    schedule: Schedule,
    times: Array | None = None,
    temperature: Array | None = None,
    seed: int = 0,
    noise: bool = True,
) -> Block:
    """Samples that the device would have put out in the session.

    Parameters
    ----------
    profile : the device
    schedule : windows in time order, or (alpha, beta, start, end) in rad and s
    times : (n,) s, device times of the samples; default: evenly from 0 on
    temperature : (n,) °C at those times, if it was recorded; nan where unknown
    seed : of everything random
    noise : whether the samples carry noise, and pass the signal chain's faults

    Raises
    ------
    InputError
        If there is no window, they overlap, or times are not ascending and finite.

    """
    windows = _windows(schedule)
    rate = profile.sampling.rate_hz
    if times is None:
        t: Array = np.arange(int((windows[-1].end + TAIL_S) * rate)) / rate
    else:
        t = _ascending(times)
    if temperature is not None:
        climate = recorded_climate(
            profile.temperature, t, np.asarray(temperature, float)
        )
        profile = replace(profile, temperature=climate)
    sensing = Sensing(_standing_at(profile, windows[0]), seed)
    _move(sensing, windows)
    ticks = _ticks(t, rate)
    blocks = [
        _piece(sensing, t[rows], ticks[rows], noise)
        for rows in (slice(i, i + PIECE) for i in range(0, len(t), PIECE))
    ]
    return concat(blocks)


def _piece(sensing: Sensing, t: Array, ticks: NDArray[np.int64], noise: bool) -> Block:
    t, taken = sensing.stamped(t)
    true = taken / sensing.pace
    if noise:
        six, degrees = sensing.sense(true, ticks, t)
    else:
        six, degrees = sensing.noiseless(true), sensing.body.temperature(true)
    return Block.of(t, six[:3].T, six[3:].T, degrees)


def _windows(schedule: Schedule) -> list[HeldWindow]:
    windows = [w if isinstance(w, HeldWindow) else HeldWindow(*w) for w in schedule]
    if not windows:
        raise InputError("no window to play again: the session has no positions")
    for i, w in enumerate(windows):
        if not np.isfinite([w.alpha, w.beta, w.gamma, w.start, w.end, *w.rate]).all():
            raise InputError(
                f"position {i + 1} cannot be played again: its angles or times are "
                "unknown"
            )
        if w.end <= w.start or (i and w.start < windows[i - 1].end):
            raise InputError(
                f"position {i + 1}: its window {w.start:g} to {w.end:g} s ends before "
                "it starts, or overlaps the one before"
            )
    return windows


def _ascending(times: Array) -> Array:
    t = np.asarray(times, dtype=float)
    if t.ndim != 1 or not np.isfinite(t).all() or np.any(np.diff(t) < 0):
        raise InputError("sample times must be finite and ascending to be played again")
    return t


def _standing_at(profile: Profile, first: HeldWindow) -> Profile:
    """Return the device switched on in the first window's position."""
    alpha, beta, gamma = np.rad2deg([first.alpha, first.beta, first.gamma]).tolist()
    motion = replace(profile.motion, alpha_deg=alpha, beta_deg=beta, gamma_deg=gamma)
    return replace(profile, motion=motion)


def _move(sensing: Sensing, windows: list[HeldWindow]) -> None:
    """Put the turns into the gaps, and vibration into the windows."""
    body, pace = sensing.body, sensing.pace
    usual = sensing.profile.motion.turn_s
    shortest = 1 / sensing.profile.sampling.rate_hz
    for i, w in enumerate(windows):
        last = windows[i - 1] if i else None
        if last is not None or any(w.rate):
            gap = w.start - (last.end if last else min(0.0, w.start - usual))
            seconds = max(min(usual, SHARE * gap), shortest)
            middle = w.start - gap / 2
            start, end = w.turn or (middle - seconds / 2, middle + seconds / 2)
            seconds = max(end - start, shortest) / pace
            body.spin(start / pace, seconds, (w.alpha, w.beta, w.gamma), w.rate)
        if w.way is not None:
            body.manoeuvres.append(replace(w.way, t=w.way.t / pace))
        if w.vibration is not None:
            body.vibration_rms[-1] = w.vibration


def _ticks(t: Array, rate: float) -> NDArray[np.int64]:
    """How many periods of the sampling clock lie before each sample, (n,)."""
    steps = np.rint(np.diff(t, prepend=t[:1] - 1 / rate) * rate)
    ticks: NDArray[np.int64] = np.clip(steps, 1, LONGEST_GAP).astype(np.int64)
    return ticks
