"""Mistakes of a program that writes what a device puts out into a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.never_wrong.bench import Bench, Floats, Samples
from benchmarks.never_wrong.written import After, Rng, Written, interrupted


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


OF_FILE: dict[str, After] = {
    "samples lost, time counted": samples_lost,
    "a gap between positions": link_failed,
    "lost samples as zeros": zeros,
    "lost samples repeated": held,
    "wrong bits": spikes,
    "resampled": resampled,
    "rates with few digits": few_digits,
    "coarse times": coarse_time,
}
