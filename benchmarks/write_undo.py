"""Writing onto an autopilot and undoing it, killed at any step, while it misbehaves.

Each trial draws a command, a step of the line or of a file at which the process ends at
once, and what the autopilot does: answers late, twice, wrongly, with NaN, keeps a value
wrongly, or starts anew and averages its gyroscopes. What was killed is followed by
`write` or `undo`. In the end the vehicle must have the old set or the new one, whole,
and what was said must be what it has. Time is that of the trial, nothing waits:
``python -m benchmarks write_undo [TRIALS]``.
"""

from __future__ import annotations

import contextlib
import io
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest import mock

import numpy as np

from benchmarks._words import how_many
from fieldcal.calibration import Calibration
from fieldcal.cli import main as fieldcal
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import ARDUPILOT, parameter_names
from fieldcal.drivers.mavlink_parameters import ParameterLink, same_float32
from fieldcal.install import transaction
from fieldcal.session import file_writing
from fieldcal.sim_device.autopilot import Autopilot

TRIALS = 1000
MOST_STEPS = 130
"""Reads, writes and files among which a process is killed."""

ATTEMPTS = 3
"""How often a command is given again whose questions were not answered."""

BIAS, SCALE, GYR = (0.2, -0.3, 0.1), (1.006, 0.992, 1.008), (0.011, -0.02, 0.006)
KNOWN = parameter_names(ARDUPILOT, 0)
WRITTEN = [n for what in ("acc_offset", "acc_scale", "gyr_offset") for n in KNOWN[what]]
OLD = {n: 1.02 if "SCAL" in n else 0.05 for n in WRITTEN}
FAULTS = ("late", "twice", "wrong", "nan", "keeps_wrong", "restarts")


class Killed(BaseException):
    """The process has ended at once."""


class Misbehaving(Autopilot):
    """An autopilot that answers some questions wrongly, so many in all."""

    def __init__(self, faults: set[str], rng: np.random.Generator) -> None:
        super().__init__("&".join(f"{name}={value}" for name, value in OLD.items()))
        self._faults, self._rng = faults, rng
        self._left = {fault: int(rng.integers(1, 6)) for fault in faults}

    def _happens(self, fault: str) -> bool:
        if self._left.get(fault, 0) and self._rng.random() < 0.3:
            self._left[fault] -= 1
            return True
        return False

    def _value(self, name: str) -> bytes:
        kept = self.parameters.get(name)
        if kept is None:
            return b""
        if self._happens("wrong"):
            self.parameters[name] = kept + 0.5
        elif self._happens("nan"):
            self.parameters[name] = float("nan")
        answer = super()._value(name)
        self.parameters[name] = kept
        return answer

    def _set(self, name: str, value: float | None) -> bytes:
        answer = super()._set(name, value)
        if value is not None and self._happens("keeps_wrong"):
            self.parameters[name] = 1.01 * value + 0.01
        return answer


class Vehicle:
    """The line to an autopilot, and the clock; a killed process is one of its steps."""

    def __init__(self, faults: set[str], rng: np.random.Generator) -> None:
        self.autopilot = Misbehaving(faults, rng)
        self.now = 0.0
        self.steps, self.killed_at = 0, -1
        self._faults, self._rng = faults, rng
        self._restart = int(rng.integers(20, 200)) if "restarts" in faults else -1
        self._down, self._beat, self._on_the_way = (
            -1.0,
            -9.0,
            list[tuple[float, bytes]](),
        )

    def step(self) -> None:
        """Go on by one step, or be killed there."""
        self.steps += 1
        if self.steps == self.killed_at:
            raise Killed

    def connect(self) -> Vehicle:
        """Open the line, unless the autopilot is starting."""
        if self.now < self._down:
            raise OSError("nobody is there")
        return self

    def pause(self, seconds: float) -> None:
        """Let some time go by."""
        self.now += seconds

    def write(self, data: bytes) -> None:
        """Hear a question."""
        self.step()
        answer = self.autopilot.hear(data)
        for copy in range(1 + ("twice" in self._faults)):
            late = self._rng.uniform(0, 1.5) if "late" in self._faults else 0.0
            self._on_the_way.append((self.now + late + 0.2 * copy, answer))

    def read(self) -> bytes:
        """Answers that have arrived."""
        self.step()
        self.now += 0.05
        if self.steps == self._restart:
            for name in KNOWN["gyr_offset"]:
                self.autopilot.parameters[name] = float(self._rng.normal(0, 0.02))
            self._down, self._on_the_way = self.now + 3.0, []
            raise OSError("hung up")
        if self.now - self._beat >= 1.0:
            self._beat = self.now
            self._on_the_way.append((self.now, self.autopilot.heartbeat()))
        due = [answer for at, answer in self._on_the_way if at <= self.now]
        self._on_the_way = [pair for pair in self._on_the_way if pair[0] > self.now]
        return b"".join(due)

    def close(self) -> None:
        """Hang up."""

    def keeps(self) -> str:
        """Which set it has: old, new, or neither; gyroscopes are its own to average."""
        kept = self.autopilot.parameters
        for said, some in (("old", OLD), ("new", new_set())):
            if all(same_float32(kept[n], v) for n, v in some.items() if "GYR" not in n):
                return said
        return "neither"


def new_set() -> dict[str, float]:
    """What the calibration of `session` has to make of the old set."""
    found = dict(OLD)
    for i in range(3):
        offset, scale, gyr = (
            KNOWN[w][i] for w in ("acc_offset", "acc_scale", "gyr_offset")
        )
        found[offset] = OLD[offset] + BIAS[i] / OLD[scale]
        found[scale] = OLD[scale] / SCALE[i]
        found[gyr] = OLD[gyr] + GYR[i]
    return found


def session(place: Path) -> Path:
    """A solved session that was recorded from such an autopilot."""
    place.mkdir()
    there = InstalledCalibration(ARDUPILOT, 0, {**OLD, "AHRS_ORIENTATION": 0.0})
    groups = {"acc_bias": BIAS, "acc_scale": SCALE, "gyr_bias": GYR}
    units = {"acc_bias": "m/s^2", "acc_scale": "1", "gyr_bias": "rad/s"}
    found = Calibration(
        "joint",
        tuple(f"{g}.{a}" for g in groups for a in "xyz"),
        np.concatenate([np.array(v) for v in groups.values()]),
        np.diag(np.repeat([1e-6, 1e-8, 1e-10], 3)),
        tuple(units[g] for g in groups for _ in "xyz"),
        5.0,
        7,
        1e-3,
        info={"decision": {"go": True, "reasons": []}},
    )
    mark = {"event": "device", "installed": there.as_table()}
    (place / "session.toml").write_text("format = 1\n")
    (place / "marks.jsonl").write_text(json.dumps(mark) + "\n")
    (place / "result.json").write_text(json.dumps(found.to_json()))
    return place


@contextlib.contextmanager
def reached(vehicle: Vehicle) -> Iterator[None]:
    """Commands reach this vehicle, and files are steps as well."""

    def opened(url: str) -> ParameterLink:
        clock = lambda: vehicle.now  # noqa: E731
        return ParameterLink("virtual", vehicle.connect, clock, vehicle.pause)

    written = file_writing.write_atomically

    def write_atomically(path: Path, content: str | bytes) -> Path:
        vehicle.step()
        done = written(path, content)
        vehicle.step()
        return done

    with (
        mock.patch("fieldcal.commands.write.open_parameters", opened),
        mock.patch("fieldcal.commands.autopilot.open_parameters", opened),
        mock.patch.object(transaction, "write_atomically", write_atomically),
    ):
        yield


def said_by(vehicle: Vehicle, *arguments: str) -> tuple[int | None, str]:
    """Exit code and text of a command; no code if it was killed."""
    out = io.StringIO()
    with reached(vehicle), contextlib.redirect_stderr(out):
        with contextlib.redirect_stdout(out):
            try:
                return fieldcal(list(arguments)), out.getvalue()
            except Killed:
                return None, out.getvalue()


def claimed(code: int | None, command: str, text: str) -> str:
    """Which set the vehicle has, by what a command said."""
    if code == 0:
        return "new" if command == "write" else "old"
    for said, kept in (("are as before", "old"), ("are as they were written", "new")):
        if said in text:
            return kept
    return "unknown" if "set by hand" in text else "untouched"


def trial(seed: int, place: Path) -> tuple[str, str, str, str]:
    """One trial: what was done, the faults, what was claimed, and what is kept."""
    rng = np.random.default_rng(seed)
    faults = {fault for fault in FAULTS if rng.random() < 0.35}
    recorded, vehicle = session(place / "s"), Vehicle(set(), rng)
    to = ("--device", "mavlink:virtual", "--yes")
    command = str(rng.choice(["write", "undo"]))
    if command == "undo":
        said_by(vehicle, "write", str(recorded), *to)
    parameters, vehicle = vehicle.autopilot.parameters, Vehicle(faults, rng)
    vehicle.autopilot.parameters = parameters
    before = vehicle.keeps()
    vehicle.killed_at = int(rng.integers(1, MOST_STEPS)) if rng.random() < 0.7 else -1
    code, text = said_by(vehicle, command, str(recorded), *to)
    what, kept = command, before
    if code is None:
        vehicle.killed_at, kept = -1, vehicle.keeps()
        what = f"{command} killed{' half way' if kept == 'neither' else ''}"
        saved = any(recorded.glob(f"{transaction.SAVED}*"))
        command = str(rng.choice(["write", "undo"])) if saved else "write"
        for _ in range(ATTEMPTS):
            code, text = said_by(vehicle, command, str(recorded), *to)
            if claimed(code, command, text) != "untouched":
                break
    claim = claimed(code, command, text)
    named = "+".join(sorted(faults)) or "none"
    return what, named, kept if claim == "untouched" else claim, vehicle.keeps()


def main() -> None:
    """Print what was tried and what was survived."""
    trials = how_many(TRIALS)
    table: Counter[tuple[str, str]] = Counter()
    bad = []
    for seed in range(trials):
        with TemporaryDirectory() as place:
            what, faults, claim, kept = trial(seed, Path(place))
        right = kept == claim and kept != "neither"
        table[
            what, "whole, and said" if right else f"claims {claim}, keeps {kept}"
        ] += 1
        if not right:
            bad.append((seed, what, faults, claim, kept))
    for (what, outcome), count in sorted(table.items()):
        print(f"{what:28} {outcome:36} {count}")
    for row in bad[:20]:
        print("not survived:", *row)
    survived = trials - len(bad)
    print(f"{survived} of {trials} trials: the old set or the new, whole, as said")


if __name__ == "__main__":
    main()
