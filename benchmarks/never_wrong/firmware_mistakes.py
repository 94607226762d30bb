"""Mistakes of a device that is cleverer than it should be while it is calibrated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from benchmarks.never_wrong.bench import Bench, Samples
from benchmarks.never_wrong.device import LAG
from benchmarks.never_wrong.written import After, Rng, Written, log_uniform

STANDARD = 9.80665


def gravity_direction(written: Written, bench: Bench, rng: Rng) -> Written:
    """An attitude filter puts out the way up, times 9.80665, within 0.01 to 1 s."""
    s, keep = written.samples, np.exp(-1 / bench.rate / log_uniform(rng, 0.01, 1.0))
    smooth = lfilter([1 - keep], [1.0, -keep], s.acc - s.acc[0], axis=0) + s.acc[0]
    size = np.linalg.norm(smooth, axis=1, keepdims=True)
    return replace(written, samples=replace(s, acc=STANDARD * smooth / size))


def calibrates_itself(written: Written, bench: Bench, rng: Rng) -> Written:
    """At some instant the device begins to use another calibration of its own.

    Biases change by 0.2 to 10 mg and 5 to 500 deg/h, scale factors by 0.01 to 0.3 %.
    """
    s = written.samples
    at = float(rng.uniform(bench.windows[0, 1], bench.windows[-1, 0]))
    before = (s.t < at)[:, None]
    scale = 1 + rng.normal(0, log_uniform(rng, 1e-4, 3e-3), 3)
    acc = s.acc * scale + rng.normal(0, log_uniform(rng, 2e-3, 0.1), 3)
    gyr = s.gyr + rng.normal(0, log_uniform(rng, 2.4e-5, 2.4e-3), 3)
    if bench.grain:  # which is one of its outputs, whatever their bias
        acc = np.round(acc / bench.grain) * bench.grain
    changed = np.where(before, acc, s.acc), np.where(before, gyr, s.gyr)
    return replace(written, samples=Samples(s.t, *changed))


def supply_falls(written: Written, bench: Bench, rng: Rng) -> Written:
    """The outputs are proportional to a supply that falls by 0.02 to 1 %.

    It falls along an exponential, to that of the calibration. In half of the devices so
    does the output at zero, which is 2 to 5 g behind a converter with a reference.
    """
    s, end = written.samples, float(written.samples.t[-1])
    tau = end * log_uniform(rng, 0.5, 10.0)
    still = (np.exp(-s.t / tau) - np.exp(-end / tau)) / (1 - np.exp(-end / tau))
    at_zero = rng.integers(2) * rng.uniform(2.0, 5.0) * STANDARD
    more = log_uniform(rng, 2e-4, 1e-2) * still[:, None]
    # it falls before the converter: what that rounded off is drawn anew
    before = s.acc + bench.grain * rng.uniform(-0.5, 0.5, s.acc.shape)
    acc = before + more * (before + at_zero)
    if bench.grain:
        acc = np.round(acc / bench.grain) * bench.grain
    return replace(written, samples=replace(s, acc=acc))


def corrected_in_steps(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device takes what its temperature does to biases from a table, in steps.

    As it warms up, biases drift by 1 to 5 grains, and jump back at 1 to 4 temperatures.
    """
    s, grain = written.samples, bench.grain or 1e-3
    warm = 1 - np.exp(-s.t / LAG)
    some, end = int(rng.integers(1, 5)), float(1 - np.exp(-bench.windows[-1, 1] / LAG))
    step = end / some
    left = warm / step - np.floor(warm / step + rng.uniform())
    left -= np.interp(bench.windows[-1, 1], s.t, left)
    changed = []
    for out, of in ((s.acc, grain), (s.gyr, log_uniform(rng, 1e-5, 2e-4))):
        jumps = of * rng.integers(1, 6, 3) * rng.choice([-1, 1], 3)
        changed.append(out + left[:, None] * jumps)
    acc, gyr = changed
    if bench.grain:
        acc = np.round(acc / bench.grain) * bench.grain
    return replace(written, samples=Samples(s.t, acc, gyr))


def shifted_at_times(written: Written, bench: Bench, rng: Rng) -> Written:
    """Biases shift by themselves at 2 to 4 instants, by 3 to 30 errors of a mean."""
    s, size = written.samples, log_uniform(rng, 3.0, 30.0)
    error = size / np.sqrt(bench.hold * bench.rate)
    acc, gyr = s.acc.copy(), s.gyr.copy()
    first, last = bench.windows[0, 0], bench.windows[-1, 0]
    for at in rng.uniform(first, last, int(rng.integers(2, 5))):
        acc[s.t < at] += rng.normal(0, error * bench.acc_noise, 3)
        gyr[s.t < at] += rng.normal(0, error * bench.gyr_noise, 3)
    if bench.grain:
        acc = np.round(acc / bench.grain) * bench.grain
    return replace(written, samples=Samples(s.t, acc, gyr))


def axes_of_screen(written: Written, bench: Bench, rng: Rng) -> Written:
    """A phone names its axes by its screen, which turned on the way between two.

    In half of the positions at most, the first ones, the axes are those of a screen
    that is a quarter of a turn about z from that of the others, to either side.
    """
    s, way = written.samples, int(rng.integers(1, len(bench.windows) // 2 + 1))
    at = rng.uniform(bench.windows[way - 1, 1], bench.windows[way, 0])
    side = float(rng.choice([-1, 1]))
    before = (s.t < at)[:, None]
    quarter = np.array([[0.0, -side, 0.0], [side, 0.0, 0.0], [0.0, 0.0, 1.0]])
    acc, gyr = (np.where(before, out @ quarter, out) for out in (s.acc, s.gyr))
    return replace(written, samples=Samples(s.t, acc, gyr))


def smoothed(written: Written, bench: Bench, rng: Rng) -> Written:
    """A program smooths the outputs and prints them with a few decimals.

    Exponentially, with a time constant of 0.05 to 3 s, once in two times; otherwise by
    the mean of the last 0.1 to 3 s. With 2 to 6 decimals, rates with one more.
    """
    s, digits = written.samples, int(rng.integers(2, 7))
    exponential, seconds = rng.random() < 0.5, log_uniform(rng, 0.05, 3.0)
    kept = np.exp(-1 / bench.rate / seconds) if exponential else 0.0
    many = 1 if exponential else max(2, round(2 * seconds * bench.rate))
    over, back = np.full(many, (1 - kept) / many), [1.0, -kept]
    acc, gyr = (
        np.round(lfilter(over, back, out - out[0], axis=0) + out[0], digits + more)
        for out, more in ((s.acc, 0), (s.gyr, 1))
    )
    return replace(written, samples=Samples(s.t, acc, gyr))


OF_FIRMWARE: dict[str, After] = {
    "gravity's direction alone": gravity_direction,
    "calibrates itself": calibrates_itself,
    "supply falls": supply_falls,
    "corrected in steps": corrected_in_steps,
    "biases shifted at times": shifted_at_times,
    "axes of the screen": axes_of_screen,
    "smoothed": smoothed,
}
