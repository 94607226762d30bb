"""Which effect is added to which recording, and what comes of it."""

from __future__ import annotations

import sys
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.injected import judging
from benchmarks.injected.judging import CONTROL, Outcome
from benchmarks.injected.physics import (
    PHYSICAL,
    Added,
    CannotShow,
    physical,
    thermometer,
)
from benchmarks.injected.recorded import REAL, Made, real, recordings
from benchmarks.injected.samples import CHAIN
from benchmarks.injected.scene import Scene
from benchmarks.injected.tables import fault, printed
from fieldcal.diagnosis import diagnose

SIZES = (10.0, 20.0)
SHARE = 3
"""By default one of so many recordings gets an effect."""

QUICK = ("mikoff 0", "ferraris", "array 6.1", "pyulog", "sunsided",
         "tomisuarez positions", "autopilot HIGHRES_IMU", "psim")  # fmt: skip
"""One of each kind."""

EFFECTS = (*PHYSICAL, *CHAIN, CONTROL)


@dataclass(frozen=True)
class Asked:
    """What the command line asks for.

    Attributes
    ----------
    everything, quick, untouched : options
    only : part of the name of an effect or a recording, or of both, EFFECT@RECORDING

    """

    everything: bool
    quick: bool
    untouched: bool
    only: str

    @classmethod
    def of(cls, words: Sequence[str]) -> Asked:
        """Read the options."""
        only = [w.removeprefix("--only=") for w in words if w.startswith("--only=")]
        flags = ("--all", "--quick", "--untouched")
        whole, quick, untouched = (flag in words for flag in flags)
        return cls(whole, quick, untouched, "".join(only))

    def wants(self, effect: str, recording: str) -> bool:
        """Whether a case is asked for by its names."""
        one, at, other = self.only.partition("@")
        if at:
            return one in effect and other in recording
        return one in effect or one in recording

    def cases(self, name: str, index: int) -> list[tuple[str, float]]:
        """Effects and sizes for a recording, the `index`-th of all."""
        if self.untouched or (self.quick and name not in QUICK):
            return []
        out = []
        for k, effect in enumerate(EFFECTS):
            by_turns = not (self.everything or self.only)
            if not self.wants(effect, name) or (by_turns and (index + k) % SHARE):
                continue
            turn = (index + k) // SHARE % len(SIZES)
            sizes = SIZES if self.everything else SIZES[turn : turn + 1]
            out += [(effect, s) for s in (sizes if effect != CONTROL else sizes[:1])]
        return out


def run() -> None:
    """Print what was wrong as it comes, and the table at the end."""
    asked, there = Asked.of(sys.argv[2:]), recordings()
    if not there:
        print(
            f"no recordings beside the project: there is no {'/'.join(REAL.parts[-2:])}"
        )
        return
    found: list[Outcome] = []
    seconds: list[float] = []
    for index, (name, make) in enumerate(there.items()):
        cases = asked.cases(name, index)
        if cases or (asked.untouched and asked.only in name):
            scene, took = _scene(name, make)
            seconds.append(took)
            print(f"{name}, {took:.1f} s: {judging.summary(scene.told)}", flush=True)
            found += outcomes(scene, cases)
    if found:
        print()
        printed(found, seconds)


def _scene(name: str, make: Callable[[], Made]) -> tuple[Scene, float]:
    one = real(name, make)
    began = time.perf_counter()
    told = diagnose(one.block, one.about)
    return Scene(one, told), time.perf_counter() - began


def outcomes(scene: Scene, cases: Sequence[tuple[str, float]]) -> Iterator[Outcome]:
    """What comes of each case; those that a recording cannot show are left out."""
    for effect, sigmas in cases:
        seed = zlib.crc32(f"{scene.real.name}, {effect}, {sigmas:g}".encode())
        try:
            added = add(effect, scene, sigmas, seed)
        except CannotShow as why:
            print(f"  - {effect}: {why}")
            continue
        one = outcome(scene, effect, sigmas, seed, added)
        if not one.right:
            print(f"  {fault(one)}", flush=True)
        yield one


def add(effect: str, scene: Scene, sigmas: float, seed: int) -> Added:
    """Add one effect.

    Raises
    ------
    CannotShow
        If the recording is no place for it.

    """
    rng = np.random.default_rng(seed)
    if effect in PHYSICAL:
        return physical(effect, scene, sigmas, rng)
    if effect == CONTROL:
        return thermometer(scene, sigmas, rng)
    return CHAIN[effect](scene, sigmas, rng)


def outcome(
    scene: Scene, effect: str, sigmas: float, seed: int, added: Added
) -> Outcome:
    """Diagnose a recording with something added, and judge."""
    before = scene.told
    began = time.perf_counter()
    after = diagnose(added.block, scene.real.about)
    took = time.perf_counter() - began
    named, aliased = judging.is_said(after, effect, added.where)
    return Outcome(
        effect,
        scene.real.name,
        sigmas,
        seed,
        added.about,
        any(judging.is_said(before, effect, added.where)),
        named,
        aliased,
        tuple(i for i in judging.lost(before, after) if i not in added.hides),
        judging.invented(before, after, effect),
        judging.summary(after),
        took,
    )
