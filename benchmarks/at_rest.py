"""Logs of a device that lies still for minutes or hours, imported as they come.

    python -m benchmarks at_rest [LOGS] [--seed=N]

Each is a Parquet file drawn with two to 21 600 s at 10 to 100 Hz, white noise, flicker
from 1 / f of its spectrum, and in turn nothing more (twice), a bias that follows the
temperature, one that settles, one that jumps, one that walks, knocks on the table, and
a nudge after which the device lies otherwise. Counted are the positions that it is cut
into, what `fieldcal diagnose` names, and processor time.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks._words import how_many, option, ran
from fieldcal.core.samples import Array

USUAL, SEED = 40, 91_000_000
G = 9.81

TRUE = {
    "nothing": set[str](), "temperature": {"temperature_bias"}, "settling": {"warm_up"},
    "step": {"bias_step"}, "walk": {"random_walk"}, "knocks": set(), "nudge": set(),
}  # fmt: skip
"""What is right to be named of each kind."""

KINDS = ("nothing", *TRUE)
ANYWAY = {"bump", "bias_step"}
"""What may be named of knocks and a nudge as well."""


class Still(NamedTuple):
    """A log: its kind, times (n,) s, outputs (n, 6) SI, and temperature (n,)."""

    kind: str
    t: Array
    six: Array
    warm: Array


def main() -> None:
    """Print what became of each kind."""
    count, first = how_many(USUAL), int(option("seed", str(SEED)))
    seen: dict[str, list[tuple[int, bool, bool, float]]] = defaultdict(list)
    for seed in range(first, first + count):
        log = draw(seed)
        places, names, seconds = _diagnosed(log)
        true = TRUE[log.kind]
        allowed = true | (ANYWAY if log.kind in ("knocks", "nudge") else set())
        false = bool(names - allowed)
        seen[log.kind].append((places, true <= names, false, seconds))
        if false or not true <= names:
            print(f"{seed} {log.kind}, {log.t[-1]:.0f} s: {sorted(names)}", flush=True)
    print("| drawn | logs | positions | named | something false | seconds, most |")
    print("|---|---|---|---|---|---|")
    for kind, rows in seen.items():
        table = np.array(rows, dtype=float)
        (most, *_, spent), least = table.max(axis=0), table[:, 0].min()
        named, wrong = table[:, 1:3].sum(axis=0)
        print(
            f"| {kind} | {len(rows)} | {least:.0f} to {most:.0f} |"
            f" {f'{named:.0f}' if TRUE[kind] else '–'} | {wrong:.0f} |"
            f" {np.median(table[:, 3]):.1f}, {spent:.1f} |"
        )


def draw(seed: int) -> Still:
    """Draw a log; the kinds come in turn."""
    rng = np.random.default_rng(seed)
    kind, rate = KINDS[seed % len(KINDS)], float(rng.choice([10, 25, 50, 100]))
    lasts = _between(rng, 120.0, 21_600.0)
    t = np.arange(int(rate * lasts)) / rate
    white = np.repeat([_between(rng, 1e-3, 2e-2), _between(rng, 2e-4, 3e-3)], 3)
    level = np.repeat([_between(rng, 3e-5, 1e-3), _between(rng, 3e-6, 1e-4)], 3)
    up = rng.normal(size=3)
    up *= G / np.linalg.norm(up)
    six = np.r_[up, 0, 0, 0] + rng.normal(0, np.repeat([0.05, 0.005], 3))
    six = six + white * rng.standard_normal((len(t), 6))
    unlike = np.exp(rng.normal(0, 0.2, 6))
    for c in range(6):
        six[:, c] += level[c] * unlike[c] * _flicker(rng, len(t), rate)
    warm = 25 + 6 * (1 - np.exp(-t / (rng.uniform(0.05, 0.4) * lasts)))
    warm += rng.uniform(0.5, 1.5) * np.sin(2 * np.pi * t / lasts * rng.uniform(1, 3))
    _spoil(kind, rng, t, six, warm, up)
    return Still(kind, t, six, warm)


def _spoil(
    kind: str, rng: np.random.Generator, t: Array, six: Array, warm: Array, up: Array
) -> None:
    """Add what is drawn beside noise."""
    lasts, axis = t[-1], int(rng.integers(3))
    later = t > lasts * rng.uniform(0.2, 0.8)
    if kind == "temperature":
        six[:, axis] += rng.uniform(2e-3, 1e-2) * (warm - 25)
    if kind == "settling":
        gone = np.exp(-t / (rng.uniform(0.05, 0.4) * lasts))
        six[:, [axis, 3 + axis]] += gone[:, None] * rng.uniform(
            [1e-2, 5e-4], [4e-2, 2e-3]
        )
    if kind == "step":
        six[later, 3 + axis] += rng.uniform(1e-3, 3e-3)
    if kind == "walk":
        steps = rng.standard_normal((len(t), 3)) / np.sqrt(len(t))
        six[:, 3:] += rng.uniform(1e-3, 3e-3) * np.cumsum(steps, axis=0)
    if kind == "knocks":
        for start in rng.uniform(0.05, 0.95, int(rng.integers(1, 4))) * lasts:
            shaken = (t > start) & (t < start + rng.uniform(0.3, 1.5))
            size = np.repeat([rng.uniform(0.2, 2.0), 0.03], 3)
            six[shaken] += size * rng.standard_normal((int(shaken.sum()), 6))
    if kind == "nudge":
        turn = rng.normal(size=3)
        turn *= np.deg2rad(rng.uniform(0.02, 0.3)) / np.linalg.norm(turn)
        six[later, :3] += np.cross(up, turn)
        begun = int(np.argmax(later))
        over = slice(begun, begun + max(1, round(0.5 / (t[1] - t[0]))))
        six[over, 3:] += turn / 0.5


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _flicker(rng: np.random.Generator, n: int, rate: float) -> Array:
    """Noise of the one-sided power 1 / (pi f), as far down as twice n shows."""
    spectrum = np.fft.rfft(rng.standard_normal(2 * n))
    f = np.fft.rfftfreq(2 * n, 1 / rate)
    f[0] = np.inf
    course = np.fft.irfft(spectrum / np.sqrt(f), 2 * n)[:n]
    out: Array = course * np.sqrt(rate / (2 * np.pi))
    return out


def _diagnosed(log: Still) -> tuple[int, set[str], float]:
    """Positions, names that were said, and processor time, s."""
    with tempfile.TemporaryDirectory() as name:
        path, out = Path(name) / "log.parquet", Path(name) / "log"
        names = ("ax", "ay", "az", "gx", "gy", "gz")
        columns = {"t": log.t, **dict(zip(names, log.six.T, strict=True))}
        pq.write_table(pa.table(columns | {"temperature": log.warm}), path)
        start = time.process_time()
        ran(["import", str(path), "-o", str(out), "--gyr-unit", "rad/s"])
        ran(["diagnose", str(out)])
        seconds = time.process_time() - start
        told = json.loads((out / "diagnosis.json").read_text())
        places = (out / "session.toml").read_text().count("[[position]]")
    return places, {e["id"] for e in told["effects"]}, seconds
