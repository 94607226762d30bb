"""Sessions of which one thing that is said is wrong, and whether anybody notices.

    python -m benchmarks wrong_fact [SESSIONS] [--seed=N]

Nothing is left out of the simulation, but a unit, an axis, a sign, the order of the
positions, one position or one angle of the fixture is another than session.toml says.
Where a parameter ends more than five of its standard uncertainties off, `diagnose` must
not say consistent, nor `solve` good.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks._words import how_many, option
from benchmarks.concealed.sessions import MOUNTINGS, plain
from benchmarks.concealed.sessions import Session as Played
from fieldcal.calibration import Calibration
from fieldcal.core.errors import FieldcalError
from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis import diagnose
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.description import Description
from fieldcal.session.folder import Session

USUAL, SEED = 120, 71_000_000
WRONG = 5.0
"""Standard uncertainties from which a parameter is wrong."""

STANDARD = 9.80665


@dataclass(frozen=True)
class Told:
    """What was recorded, and what session.toml says of it."""

    block: Block
    about: Description


Fact = Callable[[Played, int, np.random.Generator], Told]


def unit(played: Played, seed: int, rng: np.random.Generator) -> Told:
    """Accelerations in g, or rates in deg/s, that are said to be SI."""
    block = played.record(seed)
    if rng.random() < 0.5:
        return Told(replace(block, acc=block.acc / STANDARD), played.about)
    return Told(replace(block, gyr=np.rad2deg(block.gyr)), played.about)


def axes(played: Played, seed: int, rng: np.random.Generator) -> Told:
    """The device was mounted otherwise."""
    others = [m for m in MOUNTINGS if m != played.about.axes]
    there = others[int(rng.integers(len(others)))]
    return Told(played.record(seed), replace(played.about, axes=there))


def sign(played: Played, seed: int, rng: np.random.Generator) -> Told:
    """One output points the other way."""
    block, channel = played.record(seed), int(rng.integers(3))
    acc = block.acc.copy()
    acc[:, channel] *= -1
    return Told(replace(block, acc=acc), played.about)


def order(played: Played, seed: int, rng: np.random.Generator) -> Told:
    """Two positions are written down in the wrong order."""
    about = played.about
    i, j = rng.choice(len(about.positions), 2, replace=False)
    places = list(about.positions)
    places[i], places[j] = places[j], places[i]
    return Told(played.record(seed), replace(about, positions=tuple(places)))


def position(played: Played, seed: int, rng: np.random.Generator) -> Told:
    """One position was set 0.3 to 10 degrees off."""
    off = np.deg2rad(np.exp(rng.uniform(np.log(0.3), np.log(10.0))))
    windows = list(played.windows)
    i, joint = (
        int(rng.integers(len(windows))),
        "alpha" if rng.random() < 0.5 else "beta",
    )
    windows[i] = replace(windows[i], **{joint: getattr(windows[i], joint) + off})
    there = replace(played, windows=tuple(windows))
    return Told(there.record(seed), played.about)


def angle(played: Played, seed: int, rng: np.random.Generator) -> Told:
    """One angle of the fixture is 0.02 to 1 degree off wherever it is set."""
    off = np.deg2rad(np.exp(rng.uniform(np.log(0.02), np.log(1.0))))
    joint = "alpha" if rng.random() < 0.5 else "beta"
    values = [round(getattr(w, joint), 9) for w in played.windows]
    one = float(rng.choice(sorted({v for v in values if v} or set(values))))
    windows = tuple(
        replace(w, **{joint: getattr(w, joint) + off}) if v == one else w
        for w, v in zip(played.windows, values, strict=True)
    )
    there = replace(played, windows=windows)
    return Told(there.record(seed), played.about)


FACTS: Mapping[str, Fact] = {
    "unit": unit, "axes": axes, "sign": sign, "order": order,
    "a position off": position, "an angle off": angle,
}  # fmt: skip


def off_by(found: Mapping[str, tuple[float, float]], played: Played) -> float:
    """Largest error of bias and scale factor, in standard uncertainties."""
    truth = played.profile.truth
    worst = 0.0
    for group in ("acc_bias", "acc_scale", "gyr_bias"):
        for i, axis in enumerate("xyz"):
            value, sigma = found.get(f"{group}.{axis}", (np.nan, np.nan))
            if np.isfinite(value) and sigma > 0:
                off = abs(value - getattr(truth, group)[i]) / sigma
                worst = max(worst, float(off))
    return worst


def of_solve(told: Told, played: Played) -> tuple[bool, float]:
    """Whether `solve` says good, and how far its worst parameter is off."""
    session = Session(Path("wrong-fact"), told.about)
    session.__dict__["block"] = told.block
    try:
        found: Calibration = solve_session(session, usable_windows(session))
    except FieldcalError:
        return False, 0.0
    pairs = zip(found.values, found.sigma, strict=True)
    return found.good, off_by(dict(zip(found.names, pairs, strict=True)), played)


def of_diagnose(told: Told, played: Played) -> tuple[bool, float]:
    """Whether `diagnose` says consistent, and how far its worst parameter is off."""
    try:
        found = diagnose(told.block, told.about)
    except FieldcalError:
        return False, 0.0
    numbers: dict[str, tuple[float, float]] = {}
    for group, one in found.calibration.items():
        for axis, value, sigma in zip("xyz", one.value, one.sigma, strict=True):
            numbers[f"{group}.{axis}"] = value, sigma
    return found.verdict == "consistent", off_by(numbers, played)


def main() -> None:
    """Print what became of each kind of wrong fact."""
    count, first = how_many(USUAL), int(option("seed", str(SEED)))
    rows: dict[str, list[Array]] = {name: [] for name in FACTS}
    for k in range(count):
        name, seed = list(FACTS)[k % len(FACTS)], first + k
        rng = np.random.default_rng(seed)
        played = plain(rng)
        told = FACTS[name](played, seed, rng)
        said = [*of_solve(told, played), *of_diagnose(told, played)]
        rows[name].append(np.array(said, dtype=float))
        if (said[0] and said[1] > WRONG) or (said[2] and said[3] > WRONG):
            print(f"{name} (seed {seed}, {played.place}): {said}", flush=True)
    print(
        "| wrong | sessions | solve good, > 5 σ off | diagnose consistent, > 5 σ off |"
    )
    print("|---|---|---|---|")
    for name, some in rows.items():
        table = np.array(some).reshape(-1, 4)
        lost = [
            int(((table[:, i] > 0) & (table[:, i + 1] > WRONG)).sum()) for i in (0, 2)
        ]
        print(f"| {name} | {len(table)} | {lost[0]} | {lost[1]} |")
