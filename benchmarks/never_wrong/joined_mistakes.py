"""Mistakes of a session that two recordings were joined to, or should have been two."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.never_wrong.bench import Bench, Samples, drawn
from benchmarks.never_wrong.recording import recorded
from benchmarks.never_wrong.written import After, Rng, Written, log_uniform


def _begun_with(
    other: Bench, written: Written, bench: Bench, rng: Rng, least: int = 1
) -> Written:
    """The first positions of a session are those of another one, the `least` last not.

    The way between the two is missing. Times have a gap there, or go on as if nothing
    was missing.
    """
    first, s = recorded(other, rng), written.samples
    way = int(rng.integers(1, len(bench.windows) - least + 1))
    end, start = bench.windows[way - 1, 1] + 0.5, bench.windows[way, 0] - 0.5
    missing = float(start - end) if rng.integers(2) else 0.0
    a, b = first.t <= end, s.t >= start
    samples = Samples(
        np.concatenate([first.t[a], s.t[b] - missing]),
        np.concatenate([first.acc[a], s.acc[b]]),
        np.concatenate([first.gyr[a], s.gyr[b]]),
    )
    rows = [dict(row) for row in written.about["position"]]
    for row in rows:
        if row["start_s"] >= start:
            row |= {key: row[key] - missing for key in ("start_s", "end_s")}
    about = {**written.about, "position": rows}
    return replace(written, about=about, samples=samples)


def two_days(written: Written, bench: Bench, rng: Rng) -> Written:
    """The bench was set up again, and the device switched on again.

    Biases were other ones by 0.2 to 10 mg and 5 to 500 deg/h.
    """
    acc, gyr = log_uniform(rng, 2e-3, 0.1), log_uniform(rng, 2.4e-5, 2.4e-3)
    wide = 0.5 if bench.level_deg is None else bench.level_deg
    before = replace(
        bench,
        tilt=tuple(np.deg2rad(rng.normal(0, wide, 2)).tolist()),
        acc_bias=bench.acc_bias + rng.normal(0, acc, 3),
        gyr_bias=bench.gyr_bias + rng.normal(0, gyr, 3),
    )
    return _begun_with(before, written, bench, rng)


def two_devices(written: Written, bench: Bench, rng: Rng) -> Written:
    """Some of the first positions, half of all at most, are those of another device."""
    other = drawn(rng)
    names = (
        "acc_bias", "acc_scale", "gyr_bias", "gyr_scale", "device", "acc_noise",
        "gyr_noise", "grain",
    )  # fmt: skip
    before = replace(bench, **{name: getattr(other, name) for name in names})
    return _begun_with(before, written, bench, rng, -(-len(bench.windows) // 2))


def remounted(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device was taken out, and put in again a quarter of a turn otherwise."""
    i, j = rng.choice(3, 2, replace=False)
    mounting = list(bench.mounting)
    mounting[i], mounting[j] = bench.mounting[j], _opposite(bench.mounting[i])
    x, y, z = mounting
    return _begun_with(replace(bench, mounting=(x, y, z)), written, bench, rng)


def _opposite(axis: str) -> str:
    return ("+" if axis[0] == "-" else "-") + axis[1]


OF_TWO: dict[str, After] = {
    "two days joined": two_days,
    "device exchanged": two_devices,
    "device remounted": remounted,
}
