"""Devices with something concealed, recalibrated by `adaptive` and by a fixed plan.

    python -m benchmarks adaptive [DEVICES] [--seed=N] [--each]

Every device is drawn with its place, noise, tilted base and fixture; a third of them
conceals nothing, the others one effect or two. Each is led twice through the engine, on
device time: as `adaptive` asks, and through all nine positions of the same ladder.
Afterwards it is put into positions that neither took, where what the calibration says
of the force is held against a perfect device's.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed import draws, others
from benchmarks.concealed.sessions import Session, plain
from fieldcal.calibration import limits
from fieldcal.core.errors import FieldcalError
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array
from fieldcal.evaluation.so_far import SoFar
from fieldcal.planning.steps import Hold
from fieldcal.run import plan_file
from fieldcal.run.judging import judged
from fieldcal.run.operator.protocol import OperatorView, Wish
from fieldcal.run.session_run import SessionRun
from fieldcal.run.wait_reason import WaitReason
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device import profile as device
from fieldcal.sim_device.effects import kind
from fieldcal.sim_device.in_process import InProcess
from fieldcal.sim_device.vocabulary import effect

USUAL, SEED = 60, 71_000_000
SECONDS = 30.0
"""Window of each position, s."""

FASTEST = 50.0
"""Samples a second at most: what they cost is time, and noise is drawn anyway."""

NINE = [(float(a), float(b)) for a, b in product((0, -45, 45), (0, -5, 5))]
"""The fixed plan: all positions of the ladder."""

APART = ((30.0, -3.0), (-30.0, 1.0), (12.0, 4.0), (-12.0, -4.0), (38.0, 1.5))
"""Positions of neither, deg."""

MOVING = ("base_tilt", "angle_offset", "angle_scale")
"""Effects that change the force, and not what the sensors make of it."""

TILTS = {"base_tilt", "angle_offset"}
"""Models of a tilt that every device has, and that a calibration finds."""

SHOWN = tuple(
    name
    for name in draws.EQUATIONS
    if not kind(name).NEEDS_EARTH
    and not kind(name).EXAMPLE.turntable
    and name not in (*draws.TURNING, *draws.LINES)
)
"""Effects with numbers that show at rest."""

WRONG = 5.0
"""Standard uncertainties from which a parameter is wrong."""


@dataclass(frozen=True)
class Bench:
    """A device, and how the fixture sets it.

    Attributes
    ----------
    session : the device with what is concealed; its windows are not used
    angles_deg : how well angles are set, as stated and as they are

    """

    session: Session
    angles_deg: float


@dataclass(frozen=True)
class Run:
    """What came of one plan on one device.

    Attributes
    ----------
    held : positions
    go, named : whether it ended at GO; whether what is concealed is named, and no more
    off : standard uncertainties that the worst parameter is off by
    error : rms of the force in positions that were not taken, m/s^2
    choices : processor time of each judgement with the next choice, s

    """

    held: int
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


def drawn(number: int, rng: np.random.Generator) -> Bench:
    """A device that conceals nothing, an effect or two."""
    sigmas = float(np.exp(rng.uniform(*np.log((10.0, 30.0)))))
    if number % 3 == 0:
        session = plain(rng, ("ladder",))
    elif number % 6 == 5:
        session = others.several(rng, sigmas)
    else:
        session = draws.single(str(rng.choice(SHOWN)), rng, sigmas)
    concealed = dict(session.concealed)
    rate = min(session.profile.sampling.rate_hz, FASTEST)
    profile = replace(session.profile, sampling=device.Sampling(rate))
    if not TILTS & set(concealed):
        about_x, about_z = rng.normal(0.0, 0.5, 2)
        tilt = effect("base_tilt", {"about_x_deg": about_x, "about_z_deg": about_z})
        profile = replace(profile, effects=(*profile.effects, tilt))
    said = float(np.exp(rng.uniform(np.log(0.002), np.log(0.02))))
    return Bench(replace(session, profile=profile), said)


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
    """Lead the device through a plan."""
    virtual = VirtualDevice(bench.session.profile, seed)
    driver = InProcess(virtual)
    task = plan_file.task(tables(bench, run, places), "drawn")
    bounds = limits.read(task.about.grade)
    hand = Hand(driver, bench.angles_deg, seed)
    with tempfile.TemporaryDirectory() as where:
        folder = Path(where) / "session"
        with Recorder(folder, task.tables) as recorder:
            one = Timed(task, hand, recorder, lambda: driver, bounds, 1.0, 900.0)
            one.run(driver)
        end = judged(folder, bounds)
    named = _named(bench.session, end)
    found = end.found
    if found is None:
        return Run(len(end.laid.still.rows), False, named, 0.0, np.nan, ())
    go = found.good and bool(found.info["decision"]["go"])
    error = _held_out(
        bench, virtual, hand, dict(zip(found.names, found.values, strict=True))
    )
    off = _off(bench.session, found)
    return Run(len(end.laid.still.rows), go, named, off, error, tuple(one.choices))


class Timed(SessionRun):
    """A run that notes what each judgement with the next choice takes."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.choices: list[float] = []

    def _plan(self) -> Any:
        plan, reply, since = super()._plan(), None, 0.0
        try:
            step = next(plan)
            while True:
                judging = type(step).__name__ == "Judge"
                since = time.process_time() if judging else since
                reply = yield step
                step = plan.send(reply)
                if judging:
                    self.choices.append(time.process_time() - since)
        except StopIteration as done:
            return done.value


def _named(session: Session, end: SoFar) -> bool:
    """Whether what is concealed is named, or an alias of it, and nothing else."""
    if end.explanation is None:
        return False
    tilted = {e.id for e in session.profile.effects} & TILTS
    truth = set(session.concealed)
    standing = end.explanation.standing
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


def main() -> None:
    """Print what became of each plan."""
    words = sys.argv[2:]
    count = next((int(w) for w in words if w.isdigit()), USUAL)
    seed = next((int(w[7:]) for w in words if w.startswith("--seed=")), SEED)
    plans = {
        "adaptive": ({"procedure": "adaptive"}, None),
        "nine fixed": ({"procedure": "positions"}, NINE),
    }
    rows: dict[str, list[tuple[Bench, Run]]] = {name: [] for name in plans}
    for number in range(seed, seed + count):
        bench = drawn(number, np.random.default_rng(number))
        told = f"{number} {', '.join(bench.session.concealed) or 'nothing'}:"
        try:
            found = {n: led(bench, *plan, number) for n, plan in plans.items()}
        except FieldcalError as error:
            print(f"{told} {error}", flush=True)
            continue
        for name, one in found.items():
            rows[name].append((bench, one))
        if "--each" in words:
            parts = [
                f"{n} {r.held} {'GO' if r.go else 'NO-GO'}{' named' * r.named}"
                f" {1e3 * r.error:.2f} mm/s^2 {r.off:.1f} sigma"
                for n, r in found.items()
            ]
            print(f"{told} {'; '.join(parts)}", flush=True)
    _print(rows)


def _print(rows: Mapping[str, Sequence[tuple[Bench, Run]]]) -> None:
    for concealed in (False, True):
        print("with something concealed" if concealed else "nothing concealed")
        print(
            "| plan | devices | positions | GO | GO or named | error, rms | > 5 sigma |"
        )
        print("|---|---|---|---|---|---|---|")
        for name, some in rows.items():
            runs = [r for b, r in some if bool(b.session.concealed) == concealed]
            if not runs:
                continue
            held = np.array([r.held for r in runs])
            error = 1e3 * np.median([r.error for r in runs])
            good = sum(r.go or (r.named and concealed) for r in runs)
            wrong = sum(r.go and r.off > WRONG for r in runs)
            print(
                f"| {name} | {len(runs)} | {held.mean():.1f} (median"
                f" {np.median(held):.0f}) | {sum(r.go for r in runs)} | {good} |"
                f" {error:.2f} mm/s^2 | {wrong} |"
            )
    took = np.array([s for _, r in rows["adaptive"] for s in r.choices])
    ratio = [
        a.error / b.error
        for (_, a), (_, b) in zip(*rows.values(), strict=True)
        if np.isfinite(a.error + b.error)
    ]
    print(f"error of adaptive over that of nine: median {np.median(ratio):.2f}")
    print(
        f"choice: median {np.median(took):.2f} s, 95 % {np.quantile(took, 0.95):.2f} s"
        " of processor time"
    )
