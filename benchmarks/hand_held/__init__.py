"""Logs of a device without a fixture: turned by hand, laid down, written to a csv file.

    python -m benchmarks hand_held [LOGS] [--seed=N]

Each is drawn by a program that shares nothing with the estimator: an uncalibrated
device of consumer grade, nine to thirty rests of some seconds on a table or in a
trembling hand, coarse outputs, uneven stamps, lost samples, warming, a walk. It goes
through `fieldcal import` with nothing said, `solve --cross` and `diagnose` as a user
would call them. Printed: how parameters hold against their uncertainties (pulls of all
that were told), what was named right, missed or made up.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks._own_axes import own_axes
from benchmarks._words import how_many, option, ran
from benchmarks.hand_held.draws import GRAVITY, Device, Log, log
from fieldcal.core.samples import Array

LOGS, SEED = 60, 88_000_000
COUPLED = {"cross_coupling", "gyro_scale", "gyro_cross_coupling"}
"""What every such device has."""

CHAIN = {"quantisation", "dropped"}
"""What coarse outputs and lost samples may be called."""

WORTH = {"temperature_bias": {"bias_drift", "warm_up"}, "random_walk": {"bias_step"}}
"""What warming and a walk of some size are as good as, in a minute or two."""


@dataclass(frozen=True)
class Judged:
    """What became of one log.

    Attributes
    ----------
    log : it
    pulls : what parameters are off by, in their standard uncertainties
    verdict : of the diagnosis
    missed, false : effects that are there and were not named, and the other way round

    """

    log: Log
    pulls: Array
    verdict: str
    missed: set[str]
    false: set[str]


def main() -> None:
    """Print the table."""
    first, found = int(option("seed", str(SEED))), []
    for seed in range(first, first + how_many(LOGS)):
        one = judged(log(seed))
        found.append(one)
        if one.false or one.missed or one.verdict == "unexplained":
            print(seed, one.verdict, "missed", one.missed, "false", one.false)
    Console().print(table(found))


def judged(one: Log) -> Judged:
    """Import, solve and diagnose a log, and hold it against the truth."""
    with tempfile.TemporaryDirectory() as folder:
        file, session = Path(folder) / "log.csv", Path(folder) / "session"
        head = "t,ax,ay,az,gx,gy,gz,temp"
        np.savetxt(file, one.rows, "%.6f", ",", header=head, comments="")
        ran(["import", str(file), "-o", str(session)])
        _say_gravity(session / "session.toml")
        solved = json.loads(ran(["solve", str(session), "--cross", "--json"]).out)
        told = json.loads(ran(["diagnose", str(session), "--json"]).out)
    named = {e["id"] for e in told["effects"]}
    likely = named | {a for e in told["effects"] for a in e["aliases"]}
    return Judged(
        one, pulls(solved["parameters"], one.device), told["verdict"],
        COUPLED - likely, named - COUPLED - CHAIN - _may_be(one.device),
    )  # fmt: skip


def pulls(told: dict[str, Any], device: Device) -> Array:
    """What each parameter is off by, in its standard uncertainty, (k,).

    Axes are those of the tool: x is that of the accelerometer, and y is in its plane
    with the y accelerometer (an upper triangle of cross-coupling). Where biases change
    nobody knows at what instant they are the true ones: those are left out.
    """
    upper, turn = own_axes(device.acc)
    gyr = device.gyr @ turn.T
    truth = {
        "acc_bias": device.acc_bias, "acc_scale": np.diag(upper),
        "gyr_bias": device.gyr_bias, "gyr_scale": np.diag(gyr),
        "cross_coupling": (upper / np.diag(upper)[:, None])[np.triu_indices(3, 1)],
        "gyro_cross_coupling": (gyr / np.diag(gyr)[:, None])[~np.eye(3, dtype=bool)],
    }  # fmt: skip
    if device.walk or device.warmth.any():
        del truth["acc_bias"], truth["gyr_bias"]
    axes = {
        "cross_coupling": ["k12", "k13", "k23"],
        "gyro_cross_coupling": ["s12", "s13", "s21", "s23", "s31", "s32"],
    }
    out = []
    for name, values in truth.items():
        if name in told:
            one, every = told[name], axes.get(name, [])
            # of some axes turns like these tell nothing: those are not listed
            at = [every.index(n) for n in one.get("names", every)] or slice(None)
            off = np.array(one["value"], float) - values[at]
            out.append(off / np.array(one["sigma"], float))
    pulled: Array = np.concatenate([np.zeros(0), *out])
    return pulled[np.isfinite(pulled)]


def _may_be(device: Device) -> set[str]:
    """What else is there."""
    some = []
    if device.warmth.any():
        some.append("temperature_bias")
    if device.walk:
        some.append("random_walk")
    return set(some).union(*(WORTH[name] for name in some))


def _say_gravity(file: Path) -> None:
    """Say the gravity of the place, as the user knows it."""
    text, line = file.read_text(), f"[site]\ngravity = {GRAVITY}\n"
    file.write_text(
        text.replace("[site]\n", line) if "[site]" in text else f"{text}\n{line}"
    )


def table(found: list[Judged]) -> Table:
    """What was found, on tables and in hands."""
    out = Table(title="Logs of a device without a fixture")
    for name in ("held", "logs", "named right", "something false", "unexplained",
                 "rms pull", "within 1.96 sigma", "beyond 4"):  # fmt: skip
        out.add_column(name, justify="right")
    for name, hand in (("on a table", False), ("in a hand", True)):
        some = [one for one in found if bool(one.log.tremor) == hand]
        if not some:
            continue
        off = np.abs(np.concatenate([one.pulls for one in some]))
        right = [not one.missed and not one.false for one in some]
        out.add_row(
            name, str(len(some)), f"{sum(right)}",
            str(sum(bool(one.false) for one in some)),
            str(sum(one.verdict == "unexplained" for one in some)),
            f"{np.sqrt((off**2).mean()):.2f}", f"{100 * (off < 1.96).mean():.1f} %",
            f"{100 * (off > 4).mean():.1f} %",
        )  # fmt: skip
    return out
