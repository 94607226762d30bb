"""Mistakes of a fixture that is worn, loose or bent, and of what stands beside it.

Each takes a bench on which nothing was recorded yet, and spoils one thing of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.never_wrong.bench import Bench, Floats, wrongly_set
from benchmarks.never_wrong.written import Before, Rng, acting, log_uniform


def _set_by_joints(bench: Bench, off: Floats) -> Bench:
    """What joints are off by, (n, 2) rad; what is laid by hand knows none of it."""
    off[bench.stated or len(off) :] = 0.0
    return wrongly_set(bench, off)


def joints_not_square(bench: Bench, rng: Rng) -> Bench:
    """The axes of the two joints are 0.02 to 2 degrees off a right angle."""
    size = np.deg2rad(log_uniform(rng, 0.02, 2)) * rng.choice([-1, 1])
    return replace(bench, skew=float(size))


def play(bench: Bench, rng: Rng) -> Bench:
    """Joints have 0.02 to 0.5 degrees of play, and stop short of where they turn."""
    off, size = np.zeros_like(bench.off), np.deg2rad(log_uniform(rng, 0.02, 0.5))
    for i in range(1, len(off)):
        moved = bench.angles[i] - bench.angles[i - 1]
        off[i] = np.where(moved == 0, off[i - 1], -size * np.sign(moved))
    return _set_by_joints(bench, off)


def bends(bench: Bench, rng: Rng) -> Bench:
    """The fixture bends under the device, by up to 0.02 to 0.5 degrees in a joint."""
    size = np.deg2rad(log_uniform(rng, 0.02, 0.5))
    part = rng.uniform(0, 1, 2)  # by joint
    return _set_by_joints(bench, size * part * np.sin(np.deg2rad(bench.angles)))


def settles(bench: Bench, rng: Rng) -> Bench:
    """After a turn a joint goes back by 0.01 to 0.5 degrees, within 1 to 30 s."""
    size = float(np.deg2rad(log_uniform(rng, 0.01, 0.5)))
    return replace(bench, creep=size, creeps_s=log_uniform(rng, 1, 30))


def not_turned(bench: Bench, rng: Rng) -> Bench:
    """Somebody forgets to turn the device: a position is held a second time."""
    off, one = np.zeros_like(bench.off), int(rng.integers(1, len(bench.angles)))
    off[one] = np.deg2rad(bench.angles[one - 1] - bench.angles[one])
    off[one] += bench.off[one - 1] - bench.off[one]
    return wrongly_set(bench, off)


def _some(bench: Bench, rng: Rng, first: int = 0) -> tuple[tuple[float, float], ...]:
    """Spans of one position or more, from the one of that index on."""
    windows = bench.windows[first:]
    chosen = rng.random(len(windows)) < 0.5
    chosen[rng.integers(len(windows))] = True
    return tuple((float(a) - 1.5, float(b) + 0.5) for a, b in windows[chosen])


def engine_at_times(bench: Bench, rng: Rng) -> Bench:
    """An engine shakes the bench by 0.05 to 5 m/s^2 in some positions."""
    size, hum = log_uniform(rng, 0.05, 5), log_uniform(rng, 10, 80)
    return acting(bench, shaken=size, hum_hz=hum, spans=_some(bench, rng))


def held_by_hand(bench: Bench, rng: Rng) -> Bench:
    """A hand holds the device in some positions: it trembles by 0.03 to 1 degree."""
    size = float(np.deg2rad(log_uniform(rng, 0.03, 1)))
    first = len(bench.angles) - bench.faces if bench.faces else 0
    spans = _some(bench, rng, first)
    return acting(bench, swaying=size, sway_hz=log_uniform(rng, 0.3, 6), spans=spans)


def sun(bench: Bench, rng: Rng) -> Bench:
    """The sun comes out, or goes: the device is to change by 3 to 30 K, unmeasured."""
    size = log_uniform(rng, 3, 30) * float(rng.choice([-1, 1]))
    start = float(rng.uniform(0, bench.windows[-1, 0]))
    device = replace(bench.device, heated=size, heated_s=start)
    return replace(bench, device=device)


OF_FIXTURE: dict[str, Before] = {
    "joints not square": joints_not_square,
    "play of the joints": play,
    "fixture bends": bends,
    "fixture settles": settles,
    "not turned": not_turned,
    "engine at times": engine_at_times,
    "held by hand": held_by_hand,
    "sun": sun,
}
