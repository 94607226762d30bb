"""Sessions whose biases change, and whether the intervals of `solve` hold.

    python -m benchmarks carried [SESSIONS] [--seed=N]

Nothing is in the session, or a course of the biases from far below what shows to far
above it. The truth is that of the virtual device at the end of the recording: its bias
and what the course has come to. Angles are set exactly and `solve` is told so.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks._words import how_many, option
from benchmarks.concealed.draws import single
from benchmarks.concealed.sessions import Session as Played
from benchmarks.concealed.sessions import plain
from fieldcal.calibration import Calibration
from fieldcal.core.samples import Array
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session

USUAL, SEED = 120, 83_000_000
WITHIN = 1.96
"""Standard uncertainties that hold the truth 95 times of 100."""


def nothing(rng: np.random.Generator) -> Played:
    """Nothing beside bias and scale factor."""
    return plain(rng)


def walk(rng: np.random.Generator) -> Played:
    """Biases that walk, all of them or those of one axis."""
    played = plain(rng)
    noise, rate = played.profile.noise, played.profile.sampling.rate_hz
    size = 10 ** rng.uniform(-2.5, 0.0) / np.sqrt(rate)
    acc, gyr = size * noise.acc[0] / 10, size * noise.gyr[0] / 10
    names = {f"a{i}": acc for i in "xyz"} | {f"g{i}": gyr for i in "xyz"}
    if rng.random() < 0.5:
        one = str(rng.choice(list(names)))
        names = {one: names[one]}
    return replace(played.having({"random_walk": names}), label="random_walk")


def course(name: str) -> Callable[[np.random.Generator], Played]:
    """A course in time or temperature, at any size."""

    def made(rng: np.random.Generator) -> Played:
        while True:
            played = single(name, rng, float(10 ** rng.uniform(0.7, 1.8)))
            if played.angles and played.place != "static":
                return played

    return made


KINDS: Mapping[str, Callable[[np.random.Generator], Played]] = {
    "nothing": nothing,
    "bias_drift": course("bias_drift"),
    "warm_up": course("warm_up"),
    "temperature_bias": course("temperature_bias"),
    "bias_step": course("bias_step"),
    "random_walk": walk,
}


def pulls(played: Played, seed: int) -> tuple[dict[str, float], Calibration]:
    """Each parameter less the truth, in its standard uncertainties."""
    block = played.record(seed)
    bare = replace(played, profile=played.having({}).profile)
    effects = [e for e in bare.profile.effects if e.id not in played.concealed]
    bare = replace(bare, profile=replace(bare.profile, effects=tuple(effects)))
    inside = np.flatnonzero(block.t <= played.windows[-1].end)[-1]
    moved = (block.six - bare.record(seed).six)[inside]
    session = Session(Path("carried"), played.about)
    session.__dict__["block"] = block
    found = solve_session(session, usable_windows(session), angle_sigma_deg=0.0)
    truth = played.profile.truth
    out = {}
    for name, value, sigma in zip(found.names, found.values, found.sigma, strict=True):
        group, _, axis = name.partition(".")
        if group not in ("acc_bias", "acc_scale", "gyr_bias"):
            continue
        right = getattr(truth, group)["xyz".index(axis)]
        if group.endswith("bias"):
            right += moved["xyz".index(axis) + 3 * group.startswith("gyr")]
        out[name] = float((value - right) / sigma)
    return out, found


def main() -> None:
    """Print coverage and pulls for each kind of course."""
    count, first = how_many(USUAL), int(option("seed", str(SEED)))
    rows: dict[str, list[Array]] = {}
    for k in range(count):
        name, seed = list(KINDS)[k % len(KINDS)], first + k
        played = KINDS[name](np.random.default_rng(seed))
        off, found = pulls(played, seed)
        rows.setdefault(name, []).append(np.array(list(off.values())))
        if "--each" in sys.argv:
            worst = max(off, key=lambda n: abs(off[n]))
            causes = found.info.get("carried", {}).get("causes", {})
            print(name, seed, played.place, f"{played.sigmas:.1f}", worst,
                  f"{off[worst]:.1f}", causes, flush=True)  # fmt: skip
    print("| in the session | sessions | parameters | within 95 % | rms of pulls |")
    print("|---|---|---|---|---|")
    for name, some in rows.items():
        every = np.concatenate(some)
        share = 100 * np.mean(np.abs(every) < WITHIN)
        rms = np.sqrt(np.mean(every**2))
        print(f"| {name} | {len(some)} | {len(every)} | {share:.1f} % | {rms:.2f} |")
