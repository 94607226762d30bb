"""Many sessions: rate and memory of batch, what lots and shared effects are found.

    python -m benchmarks fleet 40           so many sessions are recorded and solved

Sessions are those of the virtual device, nine positions of 30 s; lots and shared rows
are drawn from what is stated here, with the information of recorded sessions.
"""

from __future__ import annotations

import os
import resource
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomlkit

from benchmarks import borrow
from fieldcal.calibration import limits
from fieldcal.core.samples import Array
from fieldcal.fleet.batch import SessionBatch
from fieldcal.fleet.lot import analyse_lot
from fieldcal.fleet.outcome import SessionTask
from fieldcal.fleet.reduced import ReducedSession
from fieldcal.fleet.shared import SharedFinding, SharedSearch
from fieldcal.fleet.tree import sessions_in
from fieldcal.fleet.workers import process_pool
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.sessions import StoredSession
from fieldcal.session.sample_table import to_record_batch
from fieldcal.sim_device.effect import SimulatedEffect
from fieldcal.sim_device.profile import Profile, Truth
from fieldcal.sim_device.replay import simulate
from fieldcal.sim_device.vocabulary import checked_effect

NINE = [(a, b) for b in (0.0, 5.0, -5.0) for a in (0.0, 45.0, -45.0)]
SECONDS, GAP = 30.0, 10.0
TRIALS = 40
"""Drawn lots, and drawn sets of sessions."""

LOTS = 100
"""Drawn lots in control."""


def recorded(
    folder: Path,
    seed: int,
    station: str = "A",
    effects: tuple[SimulatedEffect, ...] = (),
) -> Path:
    """A session of a unit of its own."""
    rng = np.random.default_rng(seed)
    wide = ((0.0, 0.1), (1.0, 5e-3), (0.0, 5e-3))
    bias, scale, rate = (m + s * rng.standard_normal(3) for m, s in wide)
    truth = Truth(tuple(bias), tuple(scale), tuple(rate))
    starts = 5.0 + (SECONDS + GAP) * np.arange(len(NINE))
    windows = [
        (*np.deg2rad(at), start, start + SECONDS)
        for at, start in zip(NINE, starts.tolist(), strict=True)
    ]
    block = simulate(Profile(truth=truth, effects=effects), windows, seed=seed)
    folder.mkdir(parents=True)
    pq.write_table(
        pa.Table.from_batches([to_record_batch(block)]), folder / "samples.parquet"
    )
    positions = [
        {"alpha_deg": a, "beta_deg": b, "start_s": s, "end_s": s + SECONDS}
        for (a, b), s in zip(NINE, starts.tolist(), strict=True)
    ]
    about = {
        "format": 1,
        "device": {"serial": f"U{seed}"},
        "site": {"latitude_deg": 50.45, "height_m": 170.0, "station": station},
        "position": positions,
    }
    (folder / "session.toml").write_text(tomlkit.dumps(about))
    return folder


def batch(place: Path, count: int) -> list[StoredSession]:
    """Rate, memory and a worker that is killed; the sessions as stored."""
    for i in range(count):
        recorded(place / "tree" / f"{i // 100}" / f"{i}", seed=i)
    folders = sessions_in([place / "tree"])
    own = SessionBatch(folders, Killing(), Database(place / "store.sqlite"))
    jobs = os.cpu_count() or 1
    begun = perf_counter()
    for _ in own.process(own.unprocessed(), process_pool(jobs)):
        pass
    wall = perf_counter() - begun
    seconds, peaks = np.loadtxt(place / "used", ndmin=2).T
    rows = own.database.run(
        lambda db: sessions.find_sessions(db, reduced=True, documents=True)
    )
    solved = sum(one.good is True for one in rows)
    data = sum(len(r.reduced or b"") for r in rows) / count / 1024
    print(
        f"{count} sessions on {jobs} processes: {seconds.mean():.2f} s of processor"
        f" time and {wall / count:.2f} s each, {peaks.max():.0f} MB a process at most"
    )
    print(
        f"a worker killed: {len(rows)} rows of {len({r.folder for r in rows})} folders,"
        f" {solved} good; {data:.0f} KiB of reduced rows each"
    )
    return rows


class Killing(SessionTask):
    """A task whose process is killed once, amid a session; notes what each takes."""

    def __call__(self, folder: str) -> StoredSession:
        """Carry it out, if the process lives."""
        root = Path(folder).parents[2]
        if folder.endswith("/1") and not (root / "killed").exists():
            (root / "killed").touch()
            os.kill(os.getpid(), 9)
        begun = process_time()
        made = super().__call__(folder)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        with (root / "used").open("a") as file:
            file.write(f"{process_time() - begun} {peak}\n")
        return made


def tilted(place: Path, count: int = 12) -> None:
    """One of three stations is tilted, and every unit is bent alike by the force."""
    common = checked_effect("g_sensitivity", {"g12": 2e-5})
    for i in range(count):
        station = "ABC"[i % 3]
        tilt = {"about_x_deg": 0.1} if station == "B" else {}
        effects = (common, *((checked_effect("base_tilt", tilt),) if tilt else ()))
        recorded(place / f"{i}", i, station, effects)
    database = Database(place / "store.sqlite")
    own = SessionBatch(sessions_in([place]), SessionTask(), database)
    alone: Counter[str] = Counter()
    for _ in own.process(own.unprocessed(), process_pool(os.cpu_count() or 1)):
        pass
    rows = database.run(
        lambda db: sessions.find_sessions(db, reduced=True, documents=True)
    )
    for one in rows:
        carried = (one.result or {}).get("not_carried", {})
        alone.update(carried.get("causes", {}))
    said = [
        f"{f.effect.key[0]} by {f.level}, P = {f.level_probability:.2f}"
        for f in SharedSearch(rows).run()
    ]
    print(
        f"{count} recorded sessions, station B tilted by 0.1 deg and all units with"
        f" g_sensitivity: together {said}; alone {dict(alone)}"
    )


# -- lots


def units(
    rng: np.random.Generator,
    count: int,
    odd: float = 0.0,
    shift: float = 0.0,
    late: int | None = None,
) -> list[StoredSession]:
    """Units of nine parameters, each with an error of half the spread.

    One in `odd` is off by 8 spreads; the `late` last ones, half of all if not given,
    are another lot and shifted by `shift` spreads in acc_bias.x.
    """
    first = count - (count // 2 if late is None else late)
    groups = (("acc_bias", 0.02, "m/s^2"), ("acc_scale", 1e-3, "1"),
              ("gyr_bias", 1e-3, "rad/s"))  # fmt: skip
    out = []
    for i in range(count):
        strange = bool(odd) and i % round(1 / odd) == 7
        which = rng.integers(9)
        seen = {}
        for k, (group, wide, unit) in enumerate(groups):
            for j, axis in enumerate("xyz"):
                own = rng.standard_normal() + 0.5 * rng.standard_normal()
                own += 8 * (strange and which == 3 * k + j)
                own += shift * (k == j == 0 and i >= first)
                middle = 1.0 if group == "acc_scale" else 0.0
                value = middle + wide * own
                seen[f"{group}.{axis}"] = (float(value), wide / 2, unit)
        name = f"odd {i}" if strange else f"{i}"
        levels = {"lot": "AB"[i >= first], "station": "PQRS"[i % 4]}
        at = f"2026-{1 + i // 800:02d}-{1 + i // 30 % 27:02d}T{i:06d}"
        out.append(StoredSession(f"/s/{i}", name, levels, at, True, True, {},
                                 parameters=seen))  # fmt: skip
    return out


def lots() -> None:
    """Odd units, shifts and drift in drawn lots; time of a large one."""
    rng, bounds = np.random.default_rng(1), limits.read("tactical")
    named = wrong = there = 0
    for _ in range(TRIALS):
        found = analyse_lot(units(rng, 300, odd=0.01), bounds)
        there += 3
        named += sum(o.serial.startswith("odd") for o in found.odd)
        wrong += sum(not o.serial.startswith("odd") for o in found.odd)
    print(
        f"odd units, 1 % of 300: {named} of {there} named, {wrong} false among"
        f" {named + wrong}"
    )
    for size in (0.0, 0.5, 1.0):
        for count, late in ((100, 50), (400, 200), (450, 50)):
            shifted(rng, bounds, size, count, late)
    for count in (60, 150, 400):
        some_lots = (analyse_lot(units(rng, count), bounds) for _ in range(LOTS))
        alarms = sum(bool(one.alarms) for one in some_lots)
        print(f"a chart has an alarm in {alarms} of {LOTS} lots of {count} in control")
    some = units(rng, 10_000)
    begun = perf_counter()
    analyse_lot(some, bounds)
    print(f"a lot of 10 000 units: {perf_counter() - begun:.1f} s")


def shifted(
    rng: np.random.Generator,
    bounds: limits.GradeLimits,
    size: float,
    count: int,
    late: int,
) -> None:
    """How often the last units of many are told to be shifted, also falsely."""
    kinds: Counter[str] = Counter()
    for _ in range(TRIALS):
        found = analyse_lot(units(rng, count, shift=size, late=late), bounds)
        kinds["lot"] += any(
            s.parameter == "acc_bias.x" and s.level == "lot" for s in found.shifts
        )
        kinds["drift"] += any(a.parameter == "acc_bias.x" for a in found.alarms)
        kinds["false"] += any(
            s.parameter != "acc_bias.x" or s.level != "lot" for s in found.shifts
        )
    print(
        f"the last {late} of {count} shifted by {size:g} spreads: lot named in"
        f" {kinds['lot']}, chart in {kinds['drift']}, a false shift in"
        f" {kinds['false']} of {TRIALS}"
    )


# -- shared effects


def drawn(
    rng: np.random.Generator, known: list[ReducedSession], u: Array, stations: int
) -> Iterator[StoredSession]:
    """Sessions of one device, ten a station, with the information of recorded ones.

    `u` (s, k) is what is there in each, in typical sizes.
    """
    for i, there in enumerate(u):
        one = known[rng.integers(len(known))]
        told, axes = np.linalg.eigh(one.matrix)
        noise = np.sqrt(np.maximum(told, 0)) * rng.standard_normal(len(told))
        rhs = one.matrix @ there + axes @ noise
        small = replace(one, rhs=rhs)
        yield StoredSession(
            f"/s/{i}", "U1", {"station": "ABCDEFGH"[i % stations]},
            reduced=small.to_bytes(),
        )  # fmt: skip


def shared(rows: list[StoredSession]) -> None:
    """How often an effect is named with its level."""
    rng = np.random.default_rng(2)
    known = [ReducedSession.from_bytes(r.reduced) for r in rows[:8] if r.reduced]
    columns = known[0].columns
    known = [one for one in known if one.columns == columns]
    number = {(c.effect, c.name): i for i, c in enumerate(columns) if not c.shape}
    tilt = next(i for (e, _), i in number.items() if e == "base_tilt")
    g_x = next(i for (e, _), i in number.items() if e == "g_sensitivity")
    two = 2 / np.sqrt(known[0].matrix[g_x, g_x])
    size = 0.1 / columns[tilt].typical
    for what, count, column, value, level in (
        ("nothing", 30, 0, 0.0, ""),
        ("2 sigma of g_sensitivity in each", 30, g_x, two, "device"),
        ("one of five stations tilted by 0.1 deg", 30, tilt, size, "station"),
    ):
        said: Counter[str] = Counter()
        begun = perf_counter()
        for _ in range(TRIALS // 2):
            u = np.zeros((count, len(columns)))
            hit = np.arange(count) % 5 == 0 if level == "station" else slice(None)
            u[hit, column] = value
            found = SharedSearch(list(drawn(rng, known, u, 5))).run()
            said[_verdict(found, columns[column].effect, level)] += 1
        spent = (perf_counter() - begun) / (TRIALS // 2)
        print(f"{what}, {count} sessions: {dict(said)}, {spent:.1f} s a search")


def _verdict(found: list[SharedFinding], effect: str, level: str) -> str:
    names = [(f.effect.key[0], f.effect.level_effect.grouping.names) for f in found]
    if not level:
        return "nothing" if not names else "false"
    right = [n for n in names if n[0] == effect and level in n[1]]
    if right and len(names) == 1:
        return "named"
    return "named, and more" if right else "other" if names else "missed"


def main() -> None:
    """Print what is measured."""
    counts = [int(word) for word in sys.argv[1:] if word.isdigit()] or [20]
    lots()
    borrow.compared(borrow.Made(), 40, TRIALS)
    rows: list[StoredSession] = []
    for count in counts:
        with TemporaryDirectory() as place:
            rows = batch(Path(place), count)
    shared(rows)
    with TemporaryDirectory() as place:
        tilted(Path(place))
