"""Awkward logs, drawn at random: the right session, or clear questions.

    python -m benchmarks awkward [LOGS] [--seed=N] [--show]

Each log is imported as a new user would, with nothing else; a question is answered by
pasting what it names, as true of the log. Counted are sessions that are right and the
questions until then, wrong units that nothing marks as guessed, faults of the program,
and memory beyond four times the rows.
"""

from __future__ import annotations

import os
import pickle
import resource
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks._words import how_many, option, ran
from benchmarks.awkward.drawn import Log, draw
from benchmarks.awkward.motion import Floats as Floats
from benchmarks.awkward.motion import G
from fieldcal.core.samples import Array
from fieldcal.session.folder import Session

USUAL, SEED = 200, 47_000_000
MOST = 5
"""Questions that are answered."""

OFF = 0.12
"""Logarithm of a scale beyond what sensors as delivered are out by."""

WILD = 10.0
"""Times what is usual, from which a row is one that was damaged."""

BASE_KB = 60_000
"""What reading any file takes beside its rows, most of it pyarrow's pools."""

AFTER = 20
"""One log in so many is solved, diagnosed and reported as well."""


class Outcome(NamedTuple):
    """What became of a log.

    Attributes
    ----------
    code : of `fieldcal import` at last
    asked : questions until then
    text : what it said
    wrong : what is wrong with the session; empty if nothing is
    guessed : quantities that were marked as guessed
    memory_kb : more than before
    after : exit codes of the commands that followed

    """

    code: int
    asked: int
    text: str
    wrong: list[str]
    guessed: list[str]
    memory_kb: int
    after: list[int]


def main() -> None:
    """Print what became of the logs, and those that went wrong."""
    count, first = how_many(USUAL), int(option("seed", str(SEED)))
    totals = Counter[str]()
    asked = Counter[int]()
    _warm()
    for k in range(count):
        seed = first + k
        with tempfile.TemporaryDirectory() as name:
            log = draw(seed, Path(name))
            got = _apart(log, Path(name), k % AFTER == 0)
        judged = judge(log, got)
        totals[judged] += 1
        asked[got.asked] += judged == "right"
        if judged not in ("right",) or "--show" in sys.argv:
            last = got.text.strip().split("\n")[-1][:230]
            print(
                f"{seed} {judged}: {log.said} {got.wrong} {got.after} | {last}",
                flush=True,
            )
    print("| outcome | logs |\n|---|---|")
    for name, many in totals.most_common():
        print(f"| {name} | {many} |")
    for questions in sorted(asked):
        print(f"| right after {questions} questions | {asked[questions]} |")


def _warm() -> None:
    """Load what reading takes, so that it is not counted with the first logs."""
    with tempfile.TemporaryDirectory() as name:
        for seed in range(3):
            log = draw(SEED - 1 - seed, Path(name))
            _imported(log, Path(name), seed == 0)
            shutil.rmtree(Path(name) / "out", ignore_errors=True)


def judge(log: Log, got: Outcome) -> str:
    """Say in a word what became of a log."""
    rows = sum(len(a) for a in log.acc)
    if got.code not in (0, 2) or any(code not in (0, 1, 2) for code in got.after):
        return "broke"
    if got.memory_kb > BASE_KB + 4 * rows * 80 / 1024:
        return "memory"
    if got.code == 2:
        return "refused"
    if got.wrong:
        said = got.guessed or "as you say, but" in got.text
        return "wrong, and said" if said else "wrong in silence"
    return "right"


def _apart(log: Log, folder: Path, after: bool) -> Outcome:
    """Import in a process of its own, whose memory is known."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        os.close(read)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        try:
            got = _imported(log, folder, after)
        except BaseException as error:  # noqa: BLE001 (whatever it is, it is counted)
            got = Outcome(70, 0, repr(error), [], [], 0, [])
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        with os.fdopen(write, "wb") as pipe:
            pickle.dump(got if after else got._replace(memory_kb=used), pipe)
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        data = pipe.read()
    os.waitpid(child, 0)
    outcome: Outcome = pickle.loads(data)  # noqa: S301 (what this process has written)
    return outcome


def _imported(log: Log, folder: Path, after: bool) -> Outcome:
    options: list[str] = []
    out = folder / "out"
    code, text, asked = 2, "", 0
    while asked <= MOST:
        code, _, text = ran(["import", str(log.path), "-o", str(out), *options])
        if code != 2 or not (answer := _answer(log, text, options)):
            break
        options, asked = options + answer, asked + 1
    if code:
        return Outcome(code, asked, text, [], [], 0, [])
    folders = [out] if (out / "session.toml").exists() else sorted(out.iterdir())
    wrong, guessed = [], []
    for i, one in enumerate(folders):
        session = Session.open(one)
        guessed += list(session.about.raw.get("guessed", {}))
        wrong += off(log, session, i)
    codes = []
    for name in ("solve", "diagnose", "report") if after else ():
        codes.append(ran([name, str(folders[0])]).code)
    shutil.rmtree(out)
    return Outcome(code, asked, text, wrong, guessed, 0, codes)


def _answer(log: Log, text: str, given: list[str]) -> list[str]:
    """What a user who knows the log would add, by the option that is asked for."""
    for word, answer in log.answers.items():
        if word in text and answer[0] not in given:
            return answer
    return []


def off(log: Log, session: Session, i: int) -> list[str]:
    """What of a session is not as it was."""
    block, wrong = session.block, []
    acc = block.acc - session.nominal["acc_bias"]
    if not np.isfinite(acc).any():
        return ["no accelerations"]
    size = float(np.median(np.linalg.norm(acc, axis=1))) / G
    if abs(np.log(size)) > OFF:
        wrong.append(f"|a| {size:.3g} g")
    n = min(len(block), len(log.acc[i]))
    if len(block) < 0.98 * len(log.acc[i]):
        wrong.append(f"{len(block)} of {len(log.acc[i])} rows")
        return wrong
    if log.kind != "wire":
        apart = float(np.median(np.abs(acc[:n] - log.acc[i][:n])))
        wrong += [f"accelerations {apart:.2g} m/s² off"] if apart > 0.5 else []
    scale = _scale(log.gyr[i][:n], block.gyr[:n]) if log.kind == "samples" else 1.0
    if abs(np.log(max(scale, 1e-9))) > OFF:
        wrong.append(f"rates {scale:.3g} times")
    if log.timed and log.kind == "samples" and log.said["spoilt"] != "jump":
        lasts = (block.t[-1] - block.t[0]) / (log.t[n - 1] - log.t[0])
        wrong += [f"time {lasts:.3g} times"] if abs(lasts - 1) > 0.01 else []
    if log.warm is not None and np.isfinite(block.temperature).any():
        apart = float(np.nanmax(np.abs(block.temperature[:n] - log.warm[:n])))
        wrong += [f"temperature {apart:.3g} K off"] if apart > 1 else []
    return wrong


def _scale(truth: Array, found: Array) -> float:
    """How much the found rates are of the true ones, by the turns."""
    true = truth - np.median(truth, axis=0)
    got = found - np.median(found, axis=0)
    if not np.isfinite(got).all() or np.std(true) < 0.02:
        return 1.0
    size = np.linalg.norm(got, axis=1)
    whole = size < WILD * np.quantile(size, 0.95)  # others were damaged
    return float((true * got)[whole].sum() / (true * true)[whole].sum())
