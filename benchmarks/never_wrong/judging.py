"""Through the command line: a session folder in, GO or NO-GO and numbers out."""

from __future__ import annotations

import contextlib
import io
import json
import math
import signal
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import tomlkit

from benchmarks.never_wrong.written import Written
from fieldcal.cli import main
from fieldcal.commands.help import EXIT_INTERRUPTED

WRONG = 5.0
"""Standard uncertainties from which a parameter is wrong."""

LIMITS = {
    "tactical": {"acc_bias": 0.02, "acc_scale": 2e-3, "gyr_bias": 1.5e-4},
    "consumer": {"acc_bias": 0.1, "acc_scale": 1e-2, "gyr_bias": 1.5e-3},
}
"""Standard uncertainty up to which a parameter may be GO by what the device is called,
m/s^2, 1 and rad/s. Of a recording from elsewhere nothing but honesty is asked.

The error itself may be larger, as often as the uncertainty says. It is counted too, and
beside it how many such errors the uncertainties lead one to expect."""

GROUPS = ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale")


@dataclass(frozen=True)
class Judged:
    """What `solve` and `diagnose` said of a session.

    Attributes
    ----------
    go : whether it may be used
    off : standard uncertainties that the worst parameter is off by, and its name
    beyond : whether a parameter is not known as well as its limit asks for
    over, chance : whether a parameter is off by more than its limit, and how probable
        that is by the uncertainties
    caught : name of the check that refused it, or the first of several
    says : its sentence
    verdict : of `diagnose`, or its exit code
    leaked : warnings of libraries that came through
    late : whether it took longer than allowed, and has no answer

    """

    go: bool
    off: float
    beyond: bool
    worst: str
    caught: str
    says: str
    verdict: str
    leaked: int
    late: bool = False
    over: bool = False
    chance: float = 0.0

    @property
    def wrong(self) -> bool:
        """Whether it is GO and must not be."""
        return self.go and (self.off > WRONG or self.beyond)


def write(folder: Path, written: Written) -> None:
    """Write the folder."""
    folder.mkdir(parents=True)
    (folder / "session.toml").write_text(tomlkit.dumps(written.about), "utf-8")
    s = written.samples
    columns = {"t": s.t}
    columns |= {f"a{a}": s.acc[:, i] for i, a in enumerate("xyz")}
    columns |= {f"g{a}": s.gyr[:, i] for i, a in enumerate("xyz")}
    table = pa.table(columns)
    if written.ending == "csv":
        pyarrow.csv.write_csv(table, folder / "samples.csv")
    else:
        pyarrow.parquet.write_table(table, folder / "samples.parquet")


def said(words: list[str]) -> tuple[int, dict[str, Any], str, int]:
    """Exit code, document, what stood on stderr, and warnings that leaked.

    Raises
    ------
    KeyboardInterrupt
        If the command was interrupted.

    """
    out, err = io.StringIO(), io.StringIO()
    with warnings.catch_warnings(record=True) as leaked:
        warnings.simplefilter("always")
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main(words)
    if code == EXIT_INTERRUPTED:
        raise KeyboardInterrupt
    try:
        document = json.loads(out.getvalue())
    except ValueError:
        document = {}
    return code, document, err.getvalue(), len(leaked)


class Late(BaseException):
    """It takes too long; no error of the command's own, which it would report."""


@contextlib.contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise `Late` when what is done within takes more processor time."""

    def over(*_: object) -> None:
        raise Late

    before = signal.signal(signal.SIGPROF, over)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def judged(
    folder: Path, truth: dict[str, float], grade: str, diagnose: bool, limit: float
) -> Judged:
    """Solve a session within `limit` s of processor time, and hold it to the truth."""
    try:
        with at_most(limit):
            return _judged(folder, truth, grade, diagnose)
    except Late:
        says = f"no answer within {limit:g} s of processor time"
        return Judged(False, 0.0, False, "", "late", says, "", 0, True)


def _judged(
    folder: Path, truth: dict[str, float], grade: str, diagnose: bool
) -> Judged:
    history = str(folder.parent / f"{folder.name}.db")
    code, found, err, leaked = said(
        ["solve", str(folder), "--json", "--history", history]
    )
    off, worst = 0.0, ""
    known = {name: sigma for name, _, sigma in _parameters(found)}
    decision = found.get("decision", {})
    limits = LIMITS[grade] if decision else {}
    beyond = any(
        not known.get(f"{group}.{axis}", np.inf) <= limit
        for group, limit in limits.items()
        for axis in "xyz"
    )
    over, chance = beyond_limit(_parameters(found), truth, limits)
    for name, value, sigma in _parameters(found):
        if name in truth:
            far = abs(value - truth[name]) / sigma
            if far > off:
                off, worst = far, f"{name} {value:.5g} ± {sigma:.2g}, {truth[name]:.5g}"
    refused = [c for c in decision.get("checks", ()) if c["ok"] is False]
    caught = refused[0]["name"] if refused else "" if code == 0 else f"exit {code}"
    says = refused[0]["says"] if refused else err.partition("\n")[0]
    verdict = ""
    if diagnose:
        answer, what, _, more = said(["diagnose", str(folder), "--json"])
        leaked += more
        verdict = str(what.get("verdict", f"exit {answer}"))
    return Judged(
        code == 0, off, beyond, worst, caught, says, verdict, leaked, False, over,
        chance,
    )  # fmt: skip


def beyond_limit(
    found: list[tuple[str, float, float]],
    truth: dict[str, float],
    limits: dict[str, float],
) -> tuple[bool, float]:
    """Whether a parameter is off by more than its limit, and how probable that is.

    The probability is that of a normal error with each standard uncertainty, in at
    least one parameter, as if errors were independent.
    """
    over, within = False, 1.0
    for name, value, sigma in found:
        limit = limits.get(name.partition(".")[0])
        if limit is not None and name in truth:
            over = over or abs(value - truth[name]) > limit
            within *= math.erf(limit / (math.sqrt(2) * sigma))
    return over, 1.0 - within


def _parameters(found: dict[str, Any]) -> list[tuple[str, float, float]]:
    out = []
    for group in GROUPS:
        entry = found.get("parameters", {}).get(group)
        if entry is not None:
            three = zip("xyz", entry["value"], entry["sigma"], strict=True)
            out += [(f"{group}.{a}", v, s) for a, v, s in three if v is not None and s]
    return out
