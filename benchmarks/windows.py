"""The windowed averager on known noise: pulls, false rejections, disturbances caught.

A pull is (mean - mean of the next window) / sqrt(sigma^2 + sigma_next^2): the error
stated is that by which the next window would differ. For flicker and random walk that
is all a window can know; the knees are relative to white noise of the same device.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import perf_counter

import numpy as np
from scipy.signal import butter, lfilter

from fieldcal.core.errors import Moved
from fieldcal.core.samples import Array, Block
from fieldcal.windows import LearnedNoise, Window, average

SEEDS = 1000
ACC, GYR = 0.05, 0.002
GRAVITY = np.array([0.0, -9.81, 0.0])
UNIT = np.repeat([ACC, GYR], 3)
DISTURBED = 5.0
"""Size of the disturbance, in standard deviations of the raw noise, for 0.5 s."""

Source = Callable[[np.random.Generator, int, float], Array]
"""Noise of unit variance or about, (n, 6), from a generator, n and the rate in Hz."""


def white(rng: np.random.Generator, n: int, _: float) -> Array:
    """Nothing but white noise."""
    return rng.standard_normal((n, 6))


def markov(phi: float) -> Source:
    """AR(1) noise, x_i = phi x_(i-1) + e_i."""

    def source(rng: np.random.Generator, n: int, _: float) -> Array:
        e = rng.standard_normal((n + 500, 6)) * np.sqrt(1 - phi**2)
        x: Array = lfilter([1], [1, -phi], e, axis=0)[500:]
        return x

    return source


def low_passed(corner_hz: float) -> Source:
    """White noise behind a second-order Butterworth filter, as in most sensors."""

    def source(rng: np.random.Generator, n: int, rate: float) -> Array:
        b, a = butter(2, 2 * corner_hz / rate)
        lead = int(10 * rate / corner_hz)
        x: Array = lfilter(b, a, rng.standard_normal((n + lead, 6)), axis=0)[lead:]
        scaled: Array = x / x.std()
        return scaled

    return source


def coloured(knee_hz: float, slope: int) -> Source:
    """White noise and f^-slope noise that are equal at the knee; none below 1/4n."""

    def source(rng: np.random.Generator, n: int, rate: float) -> Array:
        f = np.fft.rfftfreq(4 * n, 1 / rate)[1:]
        size = np.sqrt((1 + (knee_hz / f) ** slope) * 2 * n)[:, None]
        parts = rng.standard_normal((2, len(f), 6)) * size / np.sqrt(2)
        spectrum = np.vstack(
            [np.zeros((1, 6)), (parts[0] + 1j * parts[1]) * np.sqrt(2)]
        )
        return np.fft.irfft(spectrum, 4 * n, axis=0)[:n]

    return source


def humming(hz: float, amplitude: float) -> Source:
    """White noise and a line."""

    def source(rng: np.random.Generator, n: int, rate: float) -> Array:
        phase = 2 * np.pi * (hz * np.arange(n)[:, None] / rate + rng.random(6))
        return white(rng, n, rate) + amplitude * np.sin(phase)

    return source


KINDS: dict[str, Source] = {
    "white": white,
    "low-pass 20 Hz": low_passed(20),
    "low-pass 5 Hz": low_passed(5),
    "AR(1) 0.5": markov(0.5),
    "AR(1) 0.8": markov(0.8),
    "AR(1) 0.95": markov(0.95),
    "hum 50.1 Hz": humming(50.1, 3.0),
    "sway 1.9 Hz": humming(1.9, 1.0),
    "flicker 0.03 Hz": coloured(0.03, 1),
    "flicker 0.3 Hz": coloured(0.3, 1),
    "flicker 1 Hz": coloured(1.0, 1),
    "random walk 0.01 Hz": coloured(0.01, 2),
}

JUDGED: tuple[tuple[float, float, tuple[str, ...]], ...] = (
    (50, 30, ("white", "low-pass 20 Hz", "low-pass 5 Hz", "AR(1) 0.5")),
    (100, 60, ("white", "low-pass 5 Hz", "AR(1) 0.8", "flicker 0.03 Hz")),
    (200, 60, ("white",)),
    (1000, 30, ("white",)),
)
"""Rate in Hz, length in s and noises of the windows judged."""


def block_of(noise: Array, rate: float) -> Block:
    """A device at rest with this noise in units of its own."""
    six = noise * UNIT
    return Block.of(np.arange(len(six)) / rate, GRAVITY + six[:, :3], six[:, 3:])


def draws(kind: str, seconds: float, rate: float, windows: int) -> Iterator[Array]:
    """Noise of as many windows, each by its own seed."""
    for seed in range(windows):
        rng = np.random.default_rng([seed, int(seconds), int(rate)])
        yield KINDS[kind](rng, round(seconds * rate), rate)


def pulls(kind: str, seconds: float, rate: float, known: bool = False) -> Array:
    """Pulls of SEEDS channels, (3, n): ours, by 24 batch means, by sd over root n.

    `known`: ours has the noise of four windows before.
    """
    found = []
    n = round(seconds * rate)
    lead = 4 if known else 0
    for x in draws(kind, (lead + 2) * seconds, rate, SEEDS // 6 + 1):
        noise: LearnedNoise | None = None
        parts = [block_of(x[k * n : (k + 1) * n], rate) for k in range(lead + 2)]
        errors = []
        for k, part in enumerate(parts):
            window = Window(noise=noise)
            window.add(part)
            noise = window.noise if k < lead else noise
            errors.append([window.sigma, by_batches(part.six), plain(part.six)])
        change = parts[-1].six.mean(axis=0) - parts[-2].six.mean(axis=0)
        found.append(change / np.hypot(errors[-1], errors[-2]))
    return np.hstack(found)


def by_batches(six: Array) -> Array:
    """Standard error by the scatter of 24 batch means, (6,)."""
    batches = [batch.mean(axis=0) for batch in np.array_split(six, 24)]
    error: Array = np.std(batches, axis=0, ddof=1) / np.sqrt(24)
    return error


def plain(six: Array) -> Array:
    """Standard error as if the noise were white, (6,)."""
    error: Array = six.std(axis=0, ddof=1) / np.sqrt(len(six))
    return error


def rejected(kind: str, seconds: float, rate: float, size: float) -> float:
    """Share of windows rejected when a disturbance of this size lasts 0.5 s.

    A third of them are at the start, a third at the end, the others anywhere.
    """
    count = 0
    n, long = round(seconds * rate), round(0.5 * rate)
    for seed, x in enumerate(draws(kind, seconds, rate, SEEDS)):
        rng = np.random.default_rng(seed)
        first = (0, n - long, int(rng.integers(n - long)))[seed % 3]
        x[first : first + long, rng.integers(6)] += size * x.std()
        count += moved(block_of(x, rate))
    return count / SEEDS


def moved(block: Block) -> bool:
    """Whether the window is rejected."""
    try:
        average(block)
    except Moved:
        return True
    return False


def watched(kind: str, seconds: float, rate: float) -> float:
    """Share of windows of noise alone rejected when looked at every second."""
    count = 0
    for x in draws(kind, seconds, rate, SEEDS):
        block, window = block_of(x, rate), Window()
        for second in range(int(seconds)):
            window.add(block.between(second, second + 1))
            if window.disturbance:
                count += 1
                break
    return count / SEEDS


def main() -> None:
    """Print the tables."""
    began = perf_counter()
    print(f"pulls of {SEEDS} means at 100 Hz: standard deviation, share beyond 1.96")
    heads = ("30 s", "60 s", "fifth of 30 s", "24 batches", "sd/root n")
    print(f"{'':22s}" + "".join(f"{head:>14s}" for head in heads))
    for kind in KINDS:
        short, long = pulls(kind, 30, 100), pulls(kind, 60, 100)
        later = pulls(kind, 30, 100, known=True)
        columns = [short[0], long[0], later[0], long[1], long[2]]
        cells = [f"{p.std():.2f} {np.mean(abs(p) > 1.96):6.1%}" for p in columns]
        print(f"{kind:22s}" + "".join(f"{cell:>14s}" for cell in cells), flush=True)
    print(f"\nshare of {SEEDS} windows of 6 channels rejected: noise alone, and with")
    print(f"{DISTURBED:g} sigma of the raw noise for 0.5 s on one channel")
    for rate, seconds, kinds in JUDGED:
        for kind in kinds:
            alone = rejected(kind, seconds, rate, 0.0)
            caught = rejected(kind, seconds, rate, DISTURBED)
            name = f"{rate:5g} Hz {seconds:3g} s {kind}"
            print(f"{name:34s}{alone:8.1%}{caught:9.1%}", flush=True)
    alone = watched("white", 30, 50)
    print(f"   50 Hz  30 s white, looked at every second: {alone:.1%}")
    print(f"{perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
