"""Lines, bumps and faults of the signal chain, added to samples.

The size of a line and of a bump is in standard deviations of its amplitude, as a fit
that knows its frequency, or its shape and instant, would have them from what the
untouched recording shows there. What a chain does has no such size; 10 and 20 are then
a mild and a strong case of it:

    stuck         one channel repeats a value for 0.5 or 1 s within a window
    saturation    rails that one window, or the rates of turns, just reach, or overrun
    quantisation  steps of 1.4 or 1.8 times the noise, which do not move the means yet
    decode_fault  the low byte of a 16-bit count taken for a signed one
    smoothing     a low-pass of first order, 0.3 or 0.8 s, in full precision
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmarks.injected.physics import Added, CannotShow, Rng, direction
from benchmarks.injected.readout import grid, put_out, rails
from benchmarks.injected.scene import Scene
from fieldcal.core.samples import CHANNELS, Array

STRONG = 15.0
"""Standard deviations from which a fault of the chain is a strong one."""

LOWEST_HZ, HIGHEST = 3.0, 0.4
"""Of a line; the highest in sampling rates."""

NEIGHBOURS = np.concatenate([np.linspace(0.85, 0.96, 6), np.linspace(1.04, 1.15, 6)])
"""Frequencies that tell the noise about a line, in its own."""

BUMP_S = 1.0

AT_RAIL = 10
"""Samples that must be clipped."""


def hum(scene: Scene, sigmas: float, rng: Rng) -> Added:
    """A line on one triad, each axis with a phase of its own."""
    hz = float(rng.uniform(LOWEST_HZ, HIGHEST * scene.rate_hz))
    axes, phase = direction(scene, rng), rng.uniform(0, 2 * np.pi, 6)
    power = np.zeros(6)
    for near in NEIGHBOURS * hz:
        power += _power(scene, near) / len(NEIGHBOURS)
    samples = float(np.diff(scene.windows, axis=1).sum())
    used = axes != 0
    sigma = 1 / np.sqrt((axes[used] ** 2 / power[used]).sum() * samples / 2)
    wave = np.sin(2 * np.pi * hz * scene.block.t[:, None] + phase)
    six = put_out(scene.block.six, sigmas * sigma * axes * wave, rng)
    return Added(scene.but(six), f"{hz:.2f} Hz, {sigmas * sigma:.3g}", {"hz": hz})


def _power(scene: Scene, hz: float) -> Array:
    """Variance of a sample of white noise that is as strong at a frequency, (6,)."""
    t, six = scene.block.t, np.nan_to_num(scene.block.six)
    total, count = np.zeros(6), 0
    for a, b in scene.windows:
        turn = np.exp(-2j * np.pi * hz * t[a:b])
        x = (np.arange(b - a) - (b - a - 1) / 2) / (b - a)
        line = np.column_stack([np.ones(b - a), x])
        rest = six[a:b] - line @ np.linalg.lstsq(line, six[a:b], rcond=None)[0]
        total += np.abs(turn @ rest) ** 2
        count += int(b - a)
    return total / count


def bump(scene: Scene, sigmas: float, rng: Rng) -> Added:
    """One second in which a triad is pushed there and back."""
    width = round(BUMP_S * scene.rate_hz)
    long = [(int(a), int(b)) for a, b in scene.windows if b - a >= 3 * width]
    if not long:
        raise CannotShow("no window of three seconds")
    axes = direction(scene, rng)
    shape = np.sin(np.pi * (np.arange(width) + 0.5) / width)
    spread = _spread(scene, shape, long)
    used = axes != 0
    size = sigmas / np.sqrt((axes[used] ** 2 / spread[used] ** 2).sum())
    a, b = long[int(rng.integers(len(long)))]
    first = int(rng.integers(a + width // 2, b - width - width // 2 + 1))
    change = np.zeros((len(scene.block), 6))
    change[first : first + width] = size * np.outer(shape, axes)
    six = put_out(scene.block.six, change, rng)
    start = float(scene.block.t[first])
    where = {"at_s": start, "for_s": BUMP_S}
    return Added(scene.but(six), f"at {start:.1f} s, {size:.3g}", where)


def _spread(scene: Scene, shape: Array, windows: list[tuple[int, int]]) -> Array:
    """How far the amplitude of a shape comes out elsewhere in the windows, (6,)."""
    n, six = len(shape), np.nan_to_num(scene.block.six)
    around = np.concatenate([np.zeros(n // 2), shape, np.zeros(n // 2)])
    x = np.linspace(-1, 1, len(around))
    found = []
    for a, b in windows:
        for first in range(a, b - len(around) + 1, max(1, n // 2)):
            piece = six[first : first + len(around)]
            design = np.column_stack([around, np.ones(len(x)), x])
            found.append(np.linalg.lstsq(design, piece, rcond=None)[0][0])
    return np.maximum(1.4826 * np.median(np.abs(found), axis=0), 1e-12)


def stuck(scene: Scene, sigmas: float, rng: Rng) -> Added:
    """A channel that repeats one value amid a window."""
    c = int(rng.choice(scene.present))
    rows = round((1.0 if sigmas > STRONG else 0.5) * scene.rate_hz)
    six = scene.block.six.copy()
    rows = max(rows, 25, 4 * _longest_run(six[:, c], scene))
    long = [(int(a), int(b)) for a, b in scene.windows if b - a > 2 * rows]
    if not long:
        raise CannotShow("no window is long enough")
    a, b = long[int(rng.integers(len(long)))]
    first = int(rng.integers(a + rows // 4, b - rows - rows // 4))
    six[first : first + rows, c] = six[first, c]
    start, end = scene.block.t[[first, first + rows]].tolist()
    where = {"channel": CHANNELS[c], "at_s": start, "for_s": end - start}
    said = f"{CHANNELS[c]}, {rows} samples from {start:.1f} s"
    return Added(scene.but(six), said, where)


def _longest_run(values: Array, scene: Scene) -> int:
    """Most samples in a row that were equal anyway, in the windows."""
    longest = 1
    for a, b in scene.windows:
        ends = np.flatnonzero(np.diff(values[a:b]) != 0)
        edges = np.concatenate([[-1], ends, [b - a - 1]])
        longest = max(longest, int(np.diff(edges).max()))
    return longest


def saturation(scene: Scene, sigmas: float, rng: Rng) -> Added:
    """Rails of one channel, reached in a window or in turns."""
    strong, six = sigmas > STRONG, scene.block.six.copy()
    if scene.turned and 3 in scene.present and rng.random() < 0.5:
        c = int(rng.integers(3, 6))
        limit = float(np.abs(six[:, c]).max()) * (0.5 if strong else 0.7)
    else:
        c = int(rng.choice(scene.free))
        top = max(abs(float(six[a:b, c].mean())) for a, b in scene.windows)
        beyond = (0.5 if strong else 1.0) if scene.turned else (1.5 if strong else 2.0)
        limit = top + beyond * float(scene.noise[c])
    if grid(six[:, c]):
        sizes = np.abs(six[:, c])
        limit = float(sizes[sizes >= limit].min())
    six[:, c] = np.clip(six[:, c], -limit, limit)
    if int((np.abs(six[:, c]) == limit).sum()) < AT_RAIL:
        raise CannotShow("hardly anything would be clipped")
    said = f"{CHANNELS[c]}, {limit:.4g}"
    return Added(scene.but(six), said, {"channel": CHANNELS[c]})


def quantisation(scene: Scene, sigmas: float, rng: Rng) -> Added:
    """Coarse steps on one triad that stops at no rail."""
    six = scene.block.six.copy()
    stops = [bool(np.isfinite(rails(six[:, c])).any()) for c in range(6)]
    whole = [f for f in scene.triads if not any(stops[f : f + 3])]
    if not whole:
        raise CannotShow("every triad is clipped")
    first = int(rng.choice(whole))
    noise = float(scene.noise[first : first + 3].min())
    step = (1.8 if sigmas > STRONG else 1.4) * noise
    own = max(grid(six[:, c]) for c in range(first, first + 3))
    if step < 4 * own:
        raise CannotShow("its steps are coarse anyway")
    step = own * round(step / own) if own else step
    some = slice(first, first + 3)
    six[:, some] = step * np.round(six[:, some] / step)
    triad = "gyr" if first else "acc"
    return Added(scene.but(six), f"{triad}, {step:.3g}", {"parameter": triad})


def decode_fault(scene: Scene, sigmas: float, rng: Rng) -> Added:
    """Low bytes of one channel taken for signed numbers.

    In counts of its own steps, or where it has none, of a tenth of the noise; of the
    channels in which both kinds of byte come up within a window, one.
    """
    six, good = scene.block.six.copy(), []
    for c in rng.permutation(scene.present).tolist():
        step = grid(six[:, c]) or float(scene.noise[c]) / 10
        low = np.mod(np.round(six[:, c] / step), 256) >= 128
        mixed = max(_minority(low[a:b]) for a, b in scene.windows)
        if mixed > (0.1 if sigmas > STRONG else 0.02) and np.ptp(six[:, c]) > 0:
            good.append((c, step, low))
    if not good:
        raise CannotShow("no window has both kinds of byte")
    c, step, low = good[0]
    six[:, c] = step * (np.round(six[:, c] / step) - 256 * low)
    return Added(scene.but(six), f"{CHANNELS[c]}, {step:.3g}", {"channel": CHANNELS[c]})


def _minority(flags: NDArray[np.bool_]) -> float:
    share = float(flags.mean())
    return min(share, 1 - share)


def smoothing(scene: Scene, sigmas: float, rng: Rng) -> Added:
    """A program that keeps a share of the previous output in each sample.

    Missing samples are passed over, as its program does not see them.
    """
    tau = (0.8 if sigmas > STRONG else 0.3) * float(rng.uniform(0.7, 1.4))
    kept, six = np.exp(-1 / tau / scene.rate_hz), scene.block.six.copy()
    known = np.isfinite(six).all(axis=1)
    begin = six[known][:1]
    share = [1 - kept], [1.0, -kept]
    six[known] = lfilter(*share, six[known] - begin, axis=0) + begin
    return Added(scene.but(six), f"{tau:.2f} s", hides=("quantisation", "saturation"))


CHAIN = {
    "hum": hum,
    "bump": bump,
    "stuck": stuck,
    "saturation": saturation,
    "quantisation": quantisation,
    "decode_fault": decode_fault,
    "smoothing": smoothing,
}
