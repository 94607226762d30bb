"""Mistakes of a cable or a firmware, once something was recorded.

Each takes a session that is about to be written (what the device does, what it put out,
what session.toml says of it) and spoils one thing of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from benchmarks.never_wrong.bench import EARTH, Bench, Samples
from benchmarks.never_wrong.file_mistakes import OF_FILE
from benchmarks.never_wrong.firmware_mistakes import OF_FIRMWARE
from benchmarks.never_wrong.joined_mistakes import OF_TWO
from benchmarks.never_wrong.recording import recorded
from benchmarks.never_wrong.said_mistakes import SAID
from benchmarks.never_wrong.written import (
    After,
    Rng,
    Written,
    interrupted,
    log_uniform,
    tables,
)

# -- of units, wiring and order


def acc_in_g(written: Written, bench: Bench, rng: Rng) -> Written:
    """Accelerations in g are said to be in m/s^2."""
    s = written.samples
    return replace(written, samples=replace(s, acc=s.acc / 9.80665))


def gyr_in_deg(written: Written, bench: Bench, rng: Rng) -> Written:
    """Rates in deg/s are said to be in rad/s."""
    s = written.samples
    return replace(written, samples=replace(s, gyr=np.rad2deg(s.gyr)))


def gyr_said_deg(written: Written, bench: Bench, rng: Rng) -> Written:
    """Rates in rad/s are said to be in deg/s."""
    units = {**written.about.get("units", {}), "angular_rate": "deg/s"}
    return replace(written, about={**written.about, "units": units})


def time_in_ns(written: Written, bench: Bench, rng: Rng) -> Written:
    """Times in ns are said to be in s."""
    s = written.samples
    return replace(written, samples=replace(s, t=s.t * 1e9))


def axis_turned_round(written: Written, bench: Bench, rng: Rng) -> Written:
    """One output has the other sign."""
    s, c = written.samples, int(rng.integers(6))
    six = np.hstack([s.acc, s.gyr])
    six[:, c] *= -1
    return replace(written, samples=Samples(s.t, six[:, :3], six[:, 3:]))


def axes_exchanged(written: Written, bench: Bench, rng: Rng) -> Written:
    """Two outputs of a triad are exchanged."""
    s, triad = written.samples, int(rng.integers(2))
    order = [[1, 0, 2], [0, 2, 1], [2, 1, 0]][int(rng.integers(3))]
    acc = s.acc[:, order] if triad == 0 else s.acc
    gyr = s.gyr[:, order] if triad == 1 else s.gyr
    return replace(written, samples=Samples(s.t, acc, gyr))


def triad_turned_round(written: Written, bench: Bench, rng: Rng) -> Written:
    """All of a triad has the other sign: gravity for specific force, left for right."""
    s = written.samples
    if rng.integers(2):
        return replace(written, samples=replace(s, acc=-s.acc), mirrored=True)
    return replace(written, samples=replace(s, gyr=-s.gyr))


def triads_unlike(written: Written, bench: Bench, rng: Rng) -> Written:
    """The gyroscopes are a chip of their own, whose axes are called otherwise."""
    s = written.samples
    return replace(written, samples=replace(s, gyr=np.roll(s.gyr, 1, axis=1)))


def gyr_copied(written: Written, bench: Bench, rng: Rng) -> Written:
    """A gyroscope's channel copies another's."""
    s = written.samples
    a, b = rng.choice(3, 2, replace=False)
    gyr = s.gyr.copy()
    gyr[:, a] = gyr[:, b]
    return replace(written, samples=replace(s, gyr=gyr))


# -- of the firmware


def acc_mean_taken(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device takes the mean out of its accelerations."""
    s = written.samples
    return replace(written, samples=replace(s, acc=s.acc - s.acc.mean(axis=0)))


def mean_taken_and_rounded(written: Written, bench: Bench, rng: Rng) -> Written:
    """A program takes the mean out, and writes few digits."""
    s, grain = written.samples, float(rng.choice([1e-3, 1e-2, 0.1]))
    acc = np.round((s.acc - s.acc.mean(axis=0)) / grain) * grain
    return replace(written, samples=replace(s, acc=acc))


def gyr_tracked(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device takes the bias out of its rates whenever it is at rest.

    It follows the bias within half a second to five minutes.
    """
    s, gyr = written.samples, written.samples.gyr.copy()
    keep = np.exp(-1 / bench.rate / log_uniform(rng, 0.5, 300.0))
    moving = np.linalg.norm(gyr - np.median(gyr, axis=0), axis=1)
    bias = gyr[: int(bench.rate)].mean(axis=0)
    bar = 8 * bench.gyr_noise + 2 * EARTH
    for i in range(len(gyr)):
        if moving[i] < bar:
            bias = keep * bias + (1 - keep) * gyr[i]
        gyr[i] -= bias
    return replace(written, samples=replace(s, gyr=gyr))


def restarted(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device was restarted on a way, which takes 1 s or more: its biases change.

    By 0.2 to 10 mg and 5 to 500 deg/h.
    """
    s, start = interrupted(written.samples, bench, rng)
    before = s.t < start
    acc, gyr = s.acc.copy(), s.gyr.copy()
    acc[before] += rng.normal(0, np.exp(rng.uniform(*np.log([2e-3, 0.1]))), 3)
    gyr[before] += rng.normal(0, np.exp(rng.uniform(*np.log([2.4e-5, 2.4e-3]))), 3)
    if bench.grain:  # which is one of its outputs, whatever their bias
        acc = np.round(acc / bench.grain) * bench.grain
    return replace(written, samples=Samples(s.t, acc, gyr))


def stuck(written: Written, bench: Bench, rng: Rng) -> Written:
    """An output keeps a value for 5 to 60 s."""
    s, c = written.samples, int(rng.integers(6))
    start = float(rng.uniform(0, s.t[-1] - 5))
    some = s.within(start, start + float(rng.uniform(5, 60)))
    six = np.hstack([s.acc, s.gyr])
    six[some, c] = six[some, c][0]
    return replace(written, samples=Samples(s.t, six[:, :3], six[:, 3:]))


def wrapped(written: Written, bench: Bench, rng: Rng) -> Written:
    """What is beyond 8 to 9.7 m/s^2 comes out with the other sign: an overflow."""
    s, most = written.samples, rng.uniform(8, 9.7)
    acc = (s.acc + most) % (2 * most) - most
    return replace(written, samples=replace(s, acc=acc))


def cut_toward_zero(written: Written, bench: Bench, rng: Rng) -> Written:
    """Accelerations are cut toward zero to a grain larger than their noise."""
    s = written.samples
    grain = bench.acc_noise * rng.uniform(2, 20)
    ending = str(rng.choice(["csv", "parquet"]))
    acc = np.trunc(s.acc / grain) * grain
    return replace(written, samples=replace(s, acc=acc), ending=ending)


def clipped(written: Written, bench: Bench, rng: Rng) -> Written:
    """The full scale is 8 to 9.6 m/s^2."""
    s, most = written.samples, rng.uniform(8, 9.6)
    return replace(written, samples=replace(s, acc=np.clip(s.acc, -most, most)))


def acc_high_passed(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device takes what lasts 0.5 to 3000 s out of its accelerations."""
    s, keep = written.samples, np.exp(-1 / bench.rate / log_uniform(rng, 0.5, 3000))
    acc = lfilter([keep, -keep], [1.0, -keep], s.acc, axis=0)
    return replace(written, samples=replace(s, acc=acc))


def gyr_zeroed(written: Written, bench: Bench, rng: Rng) -> Written:
    """At each stop the device takes the mean of 1 to 3 s for its bias till the next."""
    s, long = written.samples, float(rng.uniform(1, 3))
    bias = s.gyr[s.within(0.0, long)].mean(axis=0)  # as it was found before, at rest
    gyr = s.gyr - bias
    for start in bench.windows[1:, 0] - 0.5:
        found = s.gyr[s.within(start, start + long)]
        if len(found):
            after = s.t > start + long
            gyr[after] = s.gyr[after] - found.mean(axis=0)
    return replace(written, samples=replace(s, gyr=gyr))


def dead_band(written: Written, bench: Bench, rng: Rng) -> Written:
    """Small outputs of a triad are 0: below 1 mm/s^2 to 1 m/s^2, 2 deg/h to 3 deg/s."""
    s = written.samples
    if rng.integers(2):
        some = np.abs(s.acc) < log_uniform(rng, 1e-3, 1.0)
        return replace(written, samples=replace(s, acc=np.where(some, 0.0, s.acc)))
    some = np.abs(s.gyr) < log_uniform(rng, 1e-5, 5e-2)
    return replace(written, samples=replace(s, gyr=np.where(some, 0.0, s.gyr)))


def sent_on_change(written: Written, bench: Bench, rng: Rng) -> Written:
    """An output is sent when it changed by 0.5 to 20 times its noise, else repeated."""
    s, bar = written.samples, log_uniform(rng, 0.5, 20)
    six = np.hstack([s.acc / bench.acc_noise, s.gyr / bench.gyr_noise])
    at = np.zeros(six.shape, int)
    for c, column in enumerate(six.T):
        last = 0
        for i, value in enumerate(column):
            if abs(value - column[last]) > bar:
                last = i
            at[i, c] = last
    acc = np.take_along_axis(s.acc, at[:, :3], 0)
    gyr = np.take_along_axis(s.gyr, at[:, 3:], 0)
    return replace(written, samples=Samples(s.t, acc, gyr))


def gyr_clipped(written: Written, bench: Bench, rng: Rng) -> Written:
    """The full scale of the gyroscopes is 0.3 to 1 of the fastest turn."""
    s = written.samples
    most = np.abs(s.gyr).max() * rng.uniform(0.3, 1)
    return replace(written, samples=replace(s, gyr=np.clip(s.gyr, -most, most)))


AFTER: dict[str, After] = (
    SAID
    | OF_FILE
    | OF_TWO
    | OF_FIRMWARE
    | {
        "g labelled m/s²": acc_in_g,
        "deg/s labelled rad/s": gyr_in_deg,
        "rad/s labelled deg/s": gyr_said_deg,
        "time in ns": time_in_ns,
        "an output reversed": axis_turned_round,
        "a triad reversed": triad_turned_round,
        "outputs exchanged": axes_exchanged,
        "triads in other axes": triads_unlike,
        "a gyroscope copied": gyr_copied,
        "mean of acc removed": acc_mean_taken,
        "mean of acc removed, rounded": mean_taken_and_rounded,
        "bias of gyr tracked": gyr_tracked,
        "cut toward zero": cut_toward_zero,
        "clipped": clipped,
        "device restarted": restarted,
        "an output stuck": stuck,
        "wrapped around": wrapped,
        "acc high-passed": acc_high_passed,
        "gyr zeroed at each stop": gyr_zeroed,
        "dead band": dead_band,
        "sent on change": sent_on_change,
        "gyr clipped in turns": gyr_clipped,
    }
)


def session(bench: Bench, names: tuple[str, ...], rng: Rng) -> Written:
    """A session on it, with the mistakes that are made afterwards."""
    written = Written(tables(bench), recorded(bench, rng))
    for name in names:
        if name in AFTER:
            written = AFTER[name](written, bench, rng)
    return written
