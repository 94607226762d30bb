"""Mistakes of a device that is cleverer than it should be while it is calibrated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from benchmarks.never_wrong.bench import Bench, Samples
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
    acc = s.acc + more * (s.acc + at_zero)
    if bench.grain:
        acc = np.round(acc / bench.grain) * bench.grain
    return replace(written, samples=replace(s, acc=acc))


OF_FIRMWARE: dict[str, After] = {
    "gravity's direction alone": gravity_direction,
    "calibrates itself": calibrates_itself,
    "supply falls": supply_falls,
}
