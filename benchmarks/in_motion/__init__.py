"""Recordings in motion, held against a simulator that follows the motion.

    python -m benchmarks in_motion [PAIRS] [--seed=N] [--lag=S] [--jitter=S]
        [--seconds=S] [--hz=F] [--noise=K]

A motion program of its own draws bodies that are swung, and IMUs on them with clocks,
axes, biases and scale factors of their own, noise of every colour, and in turn nothing
else, a lever arm, g-sensitivity, late gyroscopes, a cubic term, a low-pass of first or
of second order on one triad or both, stamps that are off, increments over an interval,
and a mount with a mode along each axis: 40 recordings of a minute at 25 Hz, or as many
as are asked for. Printed is how often that is named and something false is said, how
numbers scatter in their own standard deviations, and how stretches that were left out
are predicted, and what processor time a comparison takes. `--lag` puts a low-pass of
that time constant on the gyroscopes of all others besides, and `--jitter` makes the
stamps of samples be off by so much, one sigma. `--seconds` and `--hz` are length and
rate of other recordings. `--noise` gives the reference white noise, K times that of the
devices, and all bodies a motion of all frequencies, the weaker, the quicker it is.
"""

from __future__ import annotations

import numpy as np

from benchmarks._words import how_many, option
from benchmarks.in_motion.pairs import CALIBRATION, HZ, KINDS, SECONDS, compared, pulls

USUAL, SEED = 40, 5_000


def main() -> None:
    """Print what became of the recordings."""
    count, seed = how_many(USUAL), int(option("seed", str(SEED)))
    lag, jitter = float(option("lag", "0")), float(option("jitter", "0"))
    length, hz = float(option("seconds", str(SECONDS))), float(option("hz", str(HZ)))
    noise = float(option("noise", "0"))
    off: list[float] = []
    ahead, named, false, spent = [], 0, 0, []
    for number in range(count):
        one, found, took = compared(number, seed, lag, jitter, length, hz, noise)
        spent.append(took)
        usual = set(CALIBRATION)
        usual |= {"bandwidth"} if lag and one.kind != "bandwidth" else set()
        usual |= {"stamp_error"} if jitter and one.kind != "stamp_error" else set()
        effects = {d.id for d in found.differences} - usual
        named += one.kind in effects
        false += bool(effects - {one.kind})
        off += pulls(one, found)
        ahead.append(found.after.chi2_per_dof)
        if effects - {one.kind} or (one.kind and one.kind not in effects):
            print(f"{one.kind or 'nothing'} (number {number}): {sorted(effects)}")
    every = np.array(off)
    asked = sum(bool(KINDS[n % len(KINDS)]) for n in range(count))
    rms, often = np.sqrt(np.mean(every**2)), 100 * np.mean(np.abs(every) > 2)
    print(
        f"{count} recordings of {length:.0f} s at {hz:.0f} Hz: {named} of {asked}"
        f" effects named, something false in {false}; {len(every)} numbers off by an"
        f" rms of {rms:.2f} sigma, {often:.1f} % by more than 2, at most"
        f" {np.abs(every).max():.1f}; left out: chi2/dof {min(ahead):.2f} to"
        f" {max(ahead):.2f}; {np.median(spent):.1f} s each (median), at most"
        f" {max(spent):.1f} s"
    )
