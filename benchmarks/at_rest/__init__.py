"""Logs of a device that lies still for minutes or hours, imported as they come.

    python -m benchmarks at_rest [LOGS] [--seed=N]

Each is a Parquet file drawn with two minutes to six hours at 10 to 100 Hz, white noise,
flicker from 1 / f of its spectrum, and in turn nothing more (twice), a bias that
follows the temperature, one that settles, one that jumps, one that walks, one of an
accelerometer that jumps at a knock, and a nudge after which the device lies otherwise.
In every other log of each the table is knocked up to twelve times. Counted are the
positions that it is cut into, those of them that begin where the device lies as before,
what `fieldcal diagnose` names, and processor time of import, solve and diagnose.
"""

from __future__ import annotations

import json
import tempfile
import time
import tomllib
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks._words import how_many, option, ran
from benchmarks.at_rest.draws import KINDS, Still, draw

USUAL, SEED = 64, 91_000_000

TRUE = {
    "nothing": set[str](), "temperature": {"temperature_bias"}, "settling": {"warm_up"},
    "step": {"bias_step"}, "walk": {"random_walk"}, "shock": {"bias_step"},
    "nudge": set(),
}  # fmt: skip
"""What is right to be named of each kind."""

ANYWAY = {"bump", "bias_step"}
"""What may be named of knocks and a nudge as well."""

BROKE = 70
"""Exit code of a command that broke."""

NEAR = 30.0
"""Time within which a position begins after what made it one, s."""


class Seen(NamedTuple):
    """What became of a log.

    Attributes
    ----------
    positions : that it was cut into
    needless : of these, those that begin with no nudge
    names : that were said
    broke : whether a command did
    seconds : processor time

    """

    positions: int
    needless: int
    names: set[str]
    broke: bool
    seconds: float


def main() -> None:
    """Print what became of each kind."""
    count, first = how_many(USUAL), int(option("seed", str(SEED)))
    rows: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    for seed in range(first, first + count):
        log = draw(seed)
        seen = _seen(log)
        true = TRUE[log.kind]
        allowed = true | (ANYWAY if len(log.knocks) or log.kind == "nudge" else set())
        named, false = true <= seen.names, bool(seen.names - allowed)
        kind = log.kind + (", knocks" if len(log.knocks) else "")
        rows[kind].append(
            (seen.positions, seen.needless, named, false, seen.broke, seen.seconds)
        )
        if false or seen.broke or seen.needless or not named:
            broke = ", broke" if seen.broke else ""
            print(
                f"{seed} {kind} ({len(log.knocks)}), {log.t[-1]:.0f} s:"
                f" {seen.positions} positions, {seen.needless} needless{broke},"
                f" {sorted(seen.names)}",
                flush=True,
            )
    print(
        "| drawn | logs | positions | needless | named | something false | broke |"
        " seconds: median, most |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for kind in sorted(rows, key=lambda k: [*KINDS].index(k.split(",")[0])):
        table = np.array(rows[kind], dtype=float)
        places, _, named, wrong, broke, spent = table.T
        needs = TRUE[kind.split(",")[0]]
        print(
            f"| {kind} | {len(table)} | {places.min():.0f} to {places.max():.0f} |"
            f" {table[:, 1].sum():.0f} | {f'{named.sum():.0f}' if needs else '–'} |"
            f" {wrong.sum():.0f} | {broke.sum():.0f} |"
            f" {np.median(spent):.1f}, {spent.max():.1f} |"
        )


def _seen(log: Still) -> Seen:
    """Take a log from the file to the diagnosis."""
    with tempfile.TemporaryDirectory() as name:
        path, out = Path(name) / "log.parquet", Path(name) / "log"
        names = ("ax", "ay", "az", "gx", "gy", "gz")
        columns = {"t": log.t, **dict(zip(names, log.six.T, strict=True))}
        pq.write_table(pa.table(columns | {"temperature": log.warm}), path)
        start = time.process_time()
        codes = [
            ran(["import", str(path), "-o", str(out), "--gyr-unit", "rad/s"]).code,
            ran(["solve", str(out)]).code,
            ran(["diagnose", str(out)]).code,
        ]
        seconds = time.process_time() - start
        told = out / "diagnosis.json"
        said = json.loads(told.read_text())["effects"] if told.exists() else []
        places = tomllib.loads((out / "session.toml").read_text()).get("position", [])
    begins = [float(place["start_s"]) for place in places[1:]]
    needless = sum(not _begun_by(log.turned, start) for start in begins)
    found = {effect["id"] for effect in said}
    return Seen(len(places), needless, found, BROKE in codes, seconds)


def _begun_by(turned: float, start: float) -> bool:
    """Whether a nudge, nan if there is none, is what a position begins after."""
    return bool(-1 < start - turned < NEAR)
