"""Runs that are killed, and cables that are pulled: what is lost, and what is wrong.

    python -m benchmarks kills [RUNS]

A run against a virtual device in another process, which goes on meanwhile, is killed at
random instants (SIGKILL) and gone on with by ``--resume``, again and again until it is
done; or the link hangs up at random instants. Instants are counted in bytes recorded,
so that a busy machine has them at the same places of a session. A finished position
must be kept as it was, never be asked for again, and the result must agree with what
the device conceals.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from time import sleep
from typing import Any

import numpy as np

from benchmarks._words import how_many
from fieldcal.calibration import Calibration
from fieldcal.commands.table import true_values
from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.run.movers import VirtualMover
from fieldcal.session.marks import read_marks

KILLED, PULLED = 200, 100
SECONDS = 8.0
"""Averaging time of a position, s of device time."""

SPEED = "80"
"""Device time against the clock: at full speed it would run far ahead of a run."""

DEVICES = 20
"""Runs after which another virtual device is taken."""

MOST = 6
"""Kills of one run."""

TILT = "--base-tilt=1,-1"


@dataclass
class Outcome:
    """What became of one run.

    Attributes
    ----------
    broken : kills or pulls that hit it
    kept : finished positions that were there at a break
    lost : of those, positions asked for again or changed
    pulls : (found - concealed) / sigma of every parameter
    says : what went wrong, if it did not end in a result

    """

    broken: int = 0
    kept: int = 0
    lost: int = 0
    pulls: list[float] = field(default_factory=list)
    says: str = ""


class Bench:
    """A virtual device that outlives runs, and a plan that uses it.

    Parameters
    ----------
    folder : for plan, port and sessions
    seed : of its noise
    speed : device time against the clock

    """

    def __init__(self, folder: Path, seed: int, speed: str = SPEED) -> None:
        self.folder = folder
        port = folder / f"port-{seed}"
        options = ["--serial", "witmotion", "--speed", speed, "--seed", str(seed)]
        options += [TILT, "--port-link", str(port)]
        self.device = VirtualMover(options, once=False)
        self.plan = folder / f"plan-{seed}.toml"
        lines = ["[site]", "latitude_deg = 50.45", "height_m = 170.0", "[run]"]
        lines += [f"seconds = {SECONDS}", 'procedure = "five_position"']
        lines += [f'device = "serial:{port}?format=witmotion"', "[run.mover]"]
        lines += ['kind = "virtual"', f'control = "{self.device.control}"']
        for position in FIVE_POSITIONS:
            alpha, beta = position.degrees or (0.0, 0.0)
            lines += ["[[position]]", f"alpha_deg = {alpha}", f"beta_deg = {beta}"]
        self.plan.write_text("\n".join(lines) + "\n")

    def start(self, session: Path) -> subprocess.Popen[str]:
        """Begin a run, or go on with it if it was begun."""
        call = [sys.executable, "-m", "fieldcal", "run", "--headless", "--no-report"]
        if (session / "session.toml").exists():
            call += ["--resume", str(session)]
        else:
            call += [str(self.plan), "-o", str(session)]
        return subprocess.Popen(
            call, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )

    def pulls(self, session: Path) -> list[float]:
        """How far the result is off, in its own standard uncertainties."""
        document = json.loads((session / "result.json").read_text())
        found = Calibration.from_json(document)
        truth = true_values(self.device.truth)
        return [
            (found.value(name) - truth[name]) / found.uncertainty(name)
            for name in found.names
            if name in truth
        ]


def windows(session: Path) -> dict[int, tuple[float, float]]:
    """Windows that were marked, by position."""
    marks = read_marks(session / "marks.jsonl")
    return {
        int(m["position"]): (m["start_s"], m["end_s"])
        for m in marks
        if m["event"] == "window"
    }


def recorded(session: Path) -> int:
    """Bytes of samples that a session has."""
    file = session / "samples.arrows"
    return file.stat().st_size if file.exists() else 0


def killed(
    bench: Bench, name: str, rng: np.random.Generator, whole: float, most: int = MOST
) -> Outcome:
    """One run that is killed, so many times at most, until it gets through.

    `whole` is what a run records that nobody breaks, in bytes of samples.
    """
    session, outcome = bench.folder / name, Outcome()
    before: dict[int, tuple[float, float]] = {}
    for attempt in range(most + 1):
        process = bench.start(session)
        instant = rng.uniform(0.0, whole)
        while attempt < most and process.poll() is None and recorded(session) < instant:
            sleep(0.005)
        if attempt < most and process.poll() is None:
            process.kill()
            process.communicate()
            outcome.broken += 1
            _compare(outcome, before, session)
            before = windows(session)
            outcome.kept += len(before)
            continue
        _, said = process.communicate()
        _compare(outcome, before, session)
        return _ended(bench, session, outcome, process.returncode, said)
    raise AssertionError("the last attempt is never killed")


def pulled(
    bench: Bench, name: str, rng: np.random.Generator, whole: float, most: int = 3
) -> Outcome:
    """One run whose cable is pulled at random instants, so many times at most."""
    session, outcome = bench.folder / name, Outcome()
    process = bench.start(session)
    before: dict[int, tuple[float, float]] = {}
    # a cable that is not there at the start is another error
    for instant in 1 + np.sort(rng.uniform(0.0, whole, rng.integers(1, most + 1))):
        while process.poll() is None and recorded(session) < instant:
            sleep(0.005)
        if process.poll() is None:
            before = windows(session)
            outcome.kept += len(before)
            away = float(rng.uniform(0.2, 20.0))
            bench.device.ask(fault={"hangup_s": away})
            outcome.broken += 1
    _, said = process.communicate()
    _compare(outcome, before, session)
    return _ended(bench, session, outcome, process.returncode, said)


def _compare(
    outcome: Outcome, before: dict[int, tuple[float, float]], session: Path
) -> None:
    """Count positions that were finished and are not, or not the same."""
    now = windows(session)
    outcome.lost += sum(now.get(number) != span for number, span in before.items())


def _ended(
    bench: Bench, session: Path, outcome: Outcome, code: int, said: str
) -> Outcome:
    if (session / "result.json").exists():
        outcome.pulls = bench.pulls(session)
    else:
        outcome.says = f"exit code {code}: {said.strip().splitlines()[-1:]}"
    return outcome


def series(
    kind: str,
    runs: int,
    seed: int = 1,
    most: int | None = None,
    speed: str = SPEED,
    until: float = 1.1,
) -> list[Outcome]:
    """So many runs that are ``killed`` or ``pulled``, each `most` times at most.

    Instants lie in the first part of a whole run, or behind it if `until` is above 1;
    `speed` is the device's time against the clock.
    """
    rng, outcomes = np.random.default_rng(seed), []
    one = {"killed": killed, "pulled": pulled}[kind]
    times = {} if most is None else {"most": most}
    folder = Path(tempfile.mkdtemp(prefix="fieldcal-kills-"))
    try:
        for first in range(0, runs, DEVICES):
            bench = Bench(folder, seed + first, speed)
            bench.start(folder / f"whole-{first}").communicate()
            whole = recorded(folder / f"whole-{first}")
            for number in range(first, min(runs, first + DEVICES)):
                outcomes.append(
                    one(bench, f"run-{number}", rng, until * whole, **times)
                )
                shutil.rmtree(folder / f"run-{number}", ignore_errors=True)
            bench.device.close()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return outcomes


def show(kind: str, outcomes: list[Outcome]) -> None:
    """Print what became of them."""
    pulls = np.array([p for o in outcomes for p in o.pulls])
    table: dict[str, Any] = {
        f"runs {kind}": len(outcomes),
        "breaks": sum(o.broken for o in outcomes),
        "ended in a result": sum(bool(o.pulls) for o in outcomes),
        "finished positions at a break": sum(o.kept for o in outcomes),
        "of these lost or changed": sum(o.lost for o in outcomes),
        "numbers": len(pulls),
        "rms pull": round(float(np.sqrt((pulls**2).mean())), 3),
        "largest |pull|": round(float(np.abs(pulls).max()), 2),
        "numbers off by more than 4.5 sigma": int((np.abs(pulls) > 4.5).sum()),
    }
    for what, value in table.items():
        print(f"{what:36} {value}")
    for outcome in outcomes:
        if outcome.says:
            print(f"  {outcome.says}")


def main() -> None:
    """Print what killed runs, and half as many with pulled cables, come to."""
    killed = how_many(KILLED)
    pulled = max(killed * PULLED // KILLED, 1)
    for kind, runs in (("killed", killed), ("pulled", pulled)):
        show(kind, series(kind, runs))
