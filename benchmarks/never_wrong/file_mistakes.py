"""Mistakes of a program that writes what a device puts out into a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.never_wrong.bench import Bench, Floats, Samples
from benchmarks.never_wrong.written import (
    After,
    Rng,
    Written,
    interrupted,
    log_uniform,
)


def samples_lost(written: Written, bench: Bench, rng: Rng) -> Written:
    """Samples of 0.05 to 1 s are lost on a way, and time is counted by samples."""
    s, way = written.samples, int(rng.integers(1, len(bench.windows)))
    middle = (bench.windows[way - 1, 1] + bench.windows[way, 0]) / 2
    lost = s.within(middle, middle + np.exp(rng.uniform(np.log(0.05), 0.0)))
    t = s.t[: np.count_nonzero(~lost)]
    return replace(written, samples=Samples(t, s.acc[~lost], s.gyr[~lost]))


def link_failed(written: Written, bench: Bench, rng: Rng) -> Written:
    """Nothing comes for 1 s or more on a way; the device goes on as before."""
    samples, _ = interrupted(written.samples, bench, rng)
    return replace(written, samples=samples)


def turns_left_out(written: Written, bench: Bench, rng: Rng) -> Written:
    """The log was stopped at each turn: no sample shows how the device was turned."""
    s, kept = written.samples, np.zeros(len(written.samples.t), bool)
    more = float(rng.uniform(0.0, 0.5))
    for start, end in bench.windows:
        kept |= s.within(start - more, end + more)
    return replace(written, samples=Samples(s.t[kept], s.acc[kept], s.gyr[kept]))


def _bursts(written: Written, rng: Rng) -> list[slice]:
    """Where samples are lost: 0.1 to 3 % of them, one to 20 at a time."""
    count, longest = len(written.samples.t), int(rng.integers(1, 21))
    share = float(np.exp(rng.uniform(np.log(1e-3), np.log(0.03))))
    starts = rng.integers(1, count - longest, max(1, round(share * count / longest)))
    return [slice(int(a), int(a) + longest) for a in starts]


def zeros(written: Written, bench: Bench, rng: Rng) -> Written:
    """Samples that are lost are written as zeros."""
    s = written.samples
    acc, gyr = s.acc.copy(), s.gyr.copy()
    for some in _bursts(written, rng):
        acc[some] = gyr[some] = 0.0
    return replace(written, samples=Samples(s.t, acc, gyr))


def held(written: Written, bench: Bench, rng: Rng) -> Written:
    """In the place of samples that are lost the last one is written again."""
    s = written.samples
    acc, gyr = s.acc.copy(), s.gyr.copy()
    for some in _bursts(written, rng):
        acc[some], gyr[some] = acc[some.start - 1], gyr[some.start - 1]
    return replace(written, samples=Samples(s.t, acc, gyr))


def spikes(written: Written, bench: Bench, rng: Rng) -> Written:
    """Bits are wrong in 0.01 to 1 % of the samples: an output is anything."""
    s = written.samples
    six = np.hstack([s.acc, s.gyr])
    share = float(np.exp(rng.uniform(np.log(1e-4), np.log(1e-2))))
    at = np.flatnonzero(rng.random(len(s.t)) < share)
    six[at, rng.integers(0, 6, len(at))] = rng.uniform(-40, 40, len(at))
    return replace(written, samples=Samples(s.t, six[:, :3], six[:, 3:]))


def resampled(written: Written, bench: Bench, rng: Rng) -> Written:
    """Every second to sixth sample came, and a program drew lines between them."""
    s, each = written.samples, int(rng.integers(2, 7))

    def lines(values: Floats) -> Floats:
        return np.column_stack(
            [np.interp(s.t, s.t[::each], column[::each]) for column in values.T]
        )

    return replace(written, samples=Samples(s.t, lines(s.acc), lines(s.gyr)))


def few_digits(written: Written, bench: Bench, rng: Rng) -> Written:
    """Rates are written with two to four digits, or in whole deg/s."""
    s, grain = written.samples, float(rng.choice([1e-2, 1e-3, np.deg2rad(1), 1e-4]))
    return replace(written, samples=replace(s, gyr=np.round(s.gyr / grain) * grain))


def coarse_time(written: Written, bench: Bench, rng: Rng) -> Written:
    """Times since a start of days ago have been single precision, or whole ms."""
    s = written.samples
    if rng.integers(2):
        return replace(written, samples=replace(s, t=np.round(s.t, 3)))
    since = float(np.exp(rng.uniform(np.log(1e3), np.log(1e5))))
    t = (s.t + since).astype(np.float32).astype(float) - since
    return replace(written, samples=replace(s, t=t))


def few_significant(written: Written, bench: Bench, rng: Rng) -> Written:
    """Values are written with three or four significant digits, or in 16 bits."""
    s, digits = written.samples, int(rng.integers(2, 5))

    def short(values: Floats) -> Floats:
        if digits == 2:
            return values.astype(np.float16).astype(float)
        size = np.floor(np.log10(np.maximum(np.abs(values), 1e-12)))
        grain = 10.0 ** (size - digits + 1)
        return np.round(values / grain) * grain

    return replace(written, samples=Samples(s.t, short(s.acc), short(s.gyr)))


# -- of clocks and order


def sampled_and_held(written: Written, bench: Bench, rng: Rng) -> Written:
    """A triad, or both, are slower than the program, which writes the newest again."""
    s, share = written.samples, float(rng.uniform(0.1, 0.95))
    newest = np.floor(np.arange(len(s.t)) * share + 1e-9) / share
    at, slow = np.ceil(newest - 1e-9).astype(int), int(rng.integers(3))
    acc = s.acc[at] if slow != 1 else s.acc
    gyr = s.gyr[at] if slow != 2 else s.gyr
    return replace(written, samples=Samples(s.t, acc, gyr))


def two_clocks(written: Written, bench: Bench, rng: Rng) -> Written:
    """Rates have a clock of their own: 0.05 to 5 s off, and 10 to 100 ppm fast."""
    s, (early, slow) = written.samples, rng.choice([-1, 1], 2)
    t = s.t * (1 + slow * log_uniform(rng, 1e-5, 1e-4))
    t += early * log_uniform(rng, 0.05, 5)
    at = np.clip(np.searchsorted(s.t, t), 0, len(s.t) - 1)
    return replace(written, samples=replace(s, gyr=s.gyr[at]))


def out_of_order(written: Written, bench: Bench, rng: Rng) -> Written:
    """Packets of two to 50 samples come after the next, with their times or without."""
    s, long = written.samples, int(rng.integers(2, 51))
    order = np.arange(len(s.t))
    count = (len(order) - 2 * long) // (2 * long)
    late = np.flatnonzero(rng.random(count) < log_uniform(rng, 1e-3, 0.1))
    for start in 2 * long * late:
        some = slice(int(start), int(start) + 2 * long)
        order[some] = np.roll(order[some], long)
    t = s.t[order] if rng.integers(2) else s.t
    return replace(written, samples=Samples(t, s.acc[order], s.gyr[order]))


def clock_set(written: Written, bench: Bench, rng: Rng) -> Written:
    """The computer's clock is set forward or back by 0.02 to 20 s, or by an hour."""
    s, after = written.samples, float(rng.uniform(*written.samples.t[[0, -1]]))
    size = log_uniform(rng, 0.02, 20) if rng.random() < 0.8 else 3600.0
    late = (s.t > after) * size * rng.choice([-1, 1])
    return replace(written, samples=replace(s, t=s.t + late))


OF_FILE: dict[str, After] = {
    "samples lost, time counted": samples_lost,
    "a gap between positions": link_failed,
    "turns not recorded": turns_left_out,
    "lost samples as zeros": zeros,
    "lost samples repeated": held,
    "wrong bits": spikes,
    "resampled": resampled,
    "rates with few digits": few_digits,
    "coarse times": coarse_time,
    "few significant digits": few_significant,
    "sampled and held": sampled_and_held,
    "sensors on two clocks": two_clocks,
    "packets out of order": out_of_order,
    "clock set": clock_set,
}
