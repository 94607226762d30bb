"""A drawn device that is led through a plan, and what came of it."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.adaptive.bench import TILTS, Bench
from benchmarks.concealed.sessions import Session
from fieldcal.calibration import limits
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.evaluation.interim_result import InterimResult
from fieldcal.planning.steps import Add, Hold, Judge
from fieldcal.run import plan_file
from fieldcal.run.judging import judge_session
from fieldcal.run.operator.protocol import OperatorView, Wish
from fieldcal.run.session_run import SessionRun
from fieldcal.run.wait_reason import WaitReason
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device import profile as device
from fieldcal.sim_device.in_process import InProcess

SECONDS = 30.0
"""Window of each position, s."""

APART = ((30.0, -3.0), (-30.0, 1.0), (12.0, 4.0), (-12.0, -4.0), (38.0, 1.5))
"""Positions of neither, deg."""

MOVING = ("base_tilt", "angle_offset", "angle_scale")
"""Effects that change the force, and not what the sensors make of it."""


@dataclass(frozen=True)
class Run:
    """What came of one plan on one device.

    Attributes
    ----------
    held : positions
    until_go : of them, when it was GO for the first time; nan where it never was
    go, named : whether it ended at GO; whether what is concealed is named, and no more
    off : standard uncertainties that the worst parameter is off by
    error : rms of the force in positions that were not taken, m/s^2
    choices : processor time from each window to the next choice, s

    """

    held: int
    until_go: float
    go: bool
    named: bool
    off: float
    error: float
    choices: tuple[float, ...]


class Hand:
    """Turns the device as it is told, as well as the fixture sets angles."""

    def __init__(self, driver: InProcess, sigma_deg: float, seed: int) -> None:
        self.driver, self.sigma = driver, sigma_deg
        self.rng = np.random.default_rng(seed)
        self.said: list[str] = []

    def place(self, hold: Hold) -> None:
        """Turn."""
        alpha, beta = hold.position.degrees or (0.0, 0.0)
        off = self.rng.normal(0.0, self.sigma, 2)
        self.driver.place(Position.deg(alpha + off[0], beta + off[1]))

    def tell(self, text: str) -> None:
        """Keep what is said."""
        self.said.append(text)

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        """Keep it as well."""
        self.said.append(reason.text)

    def show(self, view: OperatorView) -> None:
        """Nobody looks."""

    def wish(self) -> Wish | None:
        """Nothing."""
        return None


def tables(bench: Bench, run: Mapping[str, Any], places: Any) -> dict[str, Any]:
    """What the plan says of the device."""
    raw = dict(bench.session.about.raw)
    site = {**raw["site"], "angle_setting_deg": bench.angles_deg}
    more: dict[str, Any] = {"site": site, "run": {"seconds": SECONDS, **run}}
    raw.pop("position")
    if places is not None:
        more["position"] = [{"alpha_deg": a, "beta_deg": b} for a, b in places]
    return {**raw, **more}


def led(bench: Bench, run: Mapping[str, Any], places: Any, seed: int) -> Run:
    """Lead the device through a plan of [run], in places or as it asks."""
    virtual = VirtualDevice(bench.session.profile, seed)
    driver = InProcess(virtual)
    task = plan_file.task_from_tables(tables(bench, run, places), "drawn")
    bounds = limits.read(task.about.grade)
    hand = Hand(driver, bench.angles_deg, seed)
    with tempfile.TemporaryDirectory() as where:
        folder = Path(where) / "session"
        with Recorder(folder, task.tables) as recorder:
            one = Timed(task, hand, recorder, lambda: driver, bounds, 1.0, 900.0)
            one.run(driver)
        end = judge_session(folder, bounds)
    named = _named(bench.session, end)
    found = end.calibration
    if found is None:
        held = len(end.prepared_session.windows.position_numbers)
        return Run(held, np.nan, False, named, 0.0, np.nan, ())
    go = found.good and bool(found.info["decision"]["go"])
    error = _held_out(
        bench, virtual, hand, dict(zip(found.names, found.values, strict=True))
    )
    off = _off(bench.session, found)
    held, choices = (
        len(end.prepared_session.windows.position_numbers),
        tuple(one.choices),
    )
    until_go = float(np.fmin(one.until_go, held if go else np.nan))
    return Run(held, until_go, go, named, off, error, choices)


class Timed(SessionRun):
    """A run that notes what each choice takes, until it is shown, and the first GO."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.choices: list[float] = []
        self.until_go = np.nan

    def _plan(self) -> Any:
        plan, since = super()._plan(), np.nan
        try:
            step = next(plan)
            while True:
                if isinstance(step, Judge) and np.isnan(since):
                    since = time.process_time()
                if isinstance(step, Add):
                    self.choices.append(time.process_time() - since)
                    since = np.nan
                reply = yield step
                if isinstance(reply, InterimResult) and reply.sufficient:
                    now = len(reply.prepared_session.windows.position_numbers)
                    self.until_go = float(np.fmin(self.until_go, now))
                step = plan.send(reply)
        except StopIteration as done:
            return done.value


def _named(session: Session, end: InterimResult) -> bool:
    """Whether what is concealed is named, or an alias of it, and nothing else."""
    if end.explanation is None:
        return False
    tilted = {e.id for e in session.profile.effects} & TILTS
    truth = set(session.concealed)
    standing = end.explanation.probable_causes
    every = (
        set().union(*({s.name, *s.aliases} for s in standing)) if standing else set()
    )
    there = truth | (TILTS if tilted else set())  # a tilt has two models
    extra = [s for s in standing if not there & {s.name, *s.aliases}]
    return truth <= every and not extra


def _off(session: Session, found: Any) -> float:
    """Standard uncertainties that the worst bias or scale factor is off by."""
    truth, worst = session.profile.truth, 0.0
    if session.concealed:
        return np.nan  # what a bias is then hangs on what is concealed
    for group in ("acc_bias", "acc_scale", "gyr_bias"):
        value, sigma = found.vector(group)
        with np.errstate(invalid="ignore"):
            off = np.abs(value - np.array(getattr(truth, group))) / sigma
        worst = max(worst, float(np.nanmax(off, initial=0.0)))
    return worst


def _held_out(
    bench: Bench, virtual: VirtualDevice, hand: Hand, values: Mapping[str, float]
) -> float:
    """Rms of the force in positions that were not taken, m/s^2."""
    profile = bench.session.profile
    perfect = VirtualDevice(
        replace(
            profile,
            truth=device.Truth((0.0,) * 3, (1.0,) * 3, (0.0,) * 3, (1.0,) * 3),
            noise=device.NoiseFigures((0.0,) * 3, (0.0,) * 3),
            effects=tuple(e for e in profile.effects if e.id in MOVING),
        )
    )
    bias = np.array([values.get(f"acc_bias.{a}", np.nan) for a in "xyz"])
    scale = np.array([values.get(f"acc_scale.{a}", np.nan) for a in "xyz"])
    off = []
    for place in APART:
        seen, true = (_mean(one, place) for one in (virtual, perfect))
        off.append((seen - bias) / scale - true)
    return float(np.sqrt(np.mean(np.square(off))))


def _mean(one: VirtualDevice, place: tuple[float, float]) -> Array:
    """Mean of the accelerometers in a position, (3,) m/s^2."""
    alpha, beta = np.deg2rad(place)
    there = one.turn(float(alpha), float(beta))
    one.take(int((there - one.time + 3.0) * one.rate))
    mean: Array = one.take(int(SECONDS * one.rate)).acc.mean(axis=0)
    return mean
