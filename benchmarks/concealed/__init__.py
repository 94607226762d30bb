"""Sessions with something concealed, drawn at random, and what the diagnosis says.

    python -m benchmarks concealed [SESSIONS] [--quick] [--only=LABEL] [--seed=N]

For every kind of session: how often it is named right or honestly aliased, how much of
what is said is not there, how the numbers hold against their intervals, and by how much
positions left out are predicted better. Seeds and effects are not known to the
diagnosis. Runs of a navigator whose set-up is wrong are solved and not diagnosed
(`navigators`).
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from itertools import chain

import numpy as np

from benchmarks._words import how_many, option
from benchmarks.concealed import draws, others, setups
from benchmarks.concealed.judging import Outcome, judged
from benchmarks.concealed.navigators import NAVIGATORS
from benchmarks.concealed.sessions import Session, plain
from benchmarks.concealed.tables import printed
from fieldcal.diagnosis import diagnose
from fieldcal.effects import catalogue
from fieldcal.sim_device.effects import kind

Draw = Callable[[np.random.Generator], Session]

USUAL, QUICK = 600, 100
EACH = 3
"""How often a kind is drawn, of the weights of all."""

SIGMAS = (10.0, 30.0)
SEED = 20_981_000
"""Of the first session; another one draws sessions that nobody has looked at."""


def _sigmas(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(*np.log(SIGMAS))))


def _single(name: str) -> Draw:
    return lambda rng: draws.single(name, rng, _sigmas(rng))


def _outside(name: str) -> Draw:
    return lambda rng: others.outside(name, rng, 2 * _sigmas(rng))


def kinds() -> Mapping[str, tuple[Draw, int]]:
    """Every kind of session by its label, with how often it is drawn."""
    out: dict[str, tuple[Draw, int]] = {"nothing": (plain, 24)}
    out["nothing, static"] = (lambda rng: plain(rng, ("static",)), 4)
    for name in draws.EQUATIONS:
        out[name] = (_single(name), 3)
    for name in others.CHANCE:
        out[name] = (lambda rng, n=name: others.chance(n, rng), 3)  # type: ignore[misc]
    for name in others.SPECIAL:
        out[name] = (lambda rng, n=name: others.special(n, rng), 3)  # type: ignore[misc]
    for name in others.CHAIN:
        out[name] = (lambda rng, n=name: others.chain(n, rng), 3)  # type: ignore[misc]
    out["pair"] = (lambda rng: others.several(rng, _sigmas(rng)), 18)
    for name in others.OUTSIDE:
        out[f"outside: {name}"] = (_outside(name), 3)
    out["three"] = (lambda rng: others.several(rng, _sigmas(rng), 3), 9)
    for name in catalogue():
        if name not in out and not kind(name).EXAMPLE.in_motion:
            out[name] = (lambda rng, n=name: others.example(n, rng), 3)  # type: ignore[misc]
    out["pier"] = (setups.pier, 3)
    out["under way"] = (setups.under_way, 3)
    out["nothing, flicker"] = (others.flickering, 9)
    out["pier, no gyroscopes"] = (setups.pier_by_force, 3)
    out["nothing, speeds"] = (setups.table_of_known_speed, 3)
    out["any attitude"] = (lambda rng: setups.any_attitude(rng, _sigmas(rng)), 3)
    return out


def drawn(
    count: int, only: str = "", first: int = SEED
) -> Iterator[tuple[int, Session]]:
    """Seeds and sessions, all kinds in turn."""
    some = {k: v for k, v in kinds().items() if only in k}
    total = sum(weight for _, weight in some.values())
    for k, (draw, weight) in enumerate(some.values()):
        for i in range(max(1, round(count * weight / total))):
            seed = 1000 * k + i + first
            session = draw(np.random.default_rng(seed))
            yield seed, session


def outcome(seed: int, session: Session) -> Outcome:
    """Record a session, diagnose it and judge."""
    block, about = session.record(seed), session.about
    start = time.perf_counter()
    told = diagnose(block, about)
    return judged(session, seed, told, time.perf_counter() - start)


def of_navigators(count: int, only: str, first: int) -> Iterator[Outcome]:
    """What is said of runs of a navigator with a wrong set-up, each like a kind."""
    mine = {k: draw for k, draw in NAVIGATORS.items() if only in k}
    rest = sum(weight for k, (_, weight) in kinds().items() if only in k)
    each = max(1, round(count * EACH / (rest or EACH * max(len(mine), 1))))
    for k, draw in enumerate(mine.values(), len(kinds())):
        for seed in range(1000 * k + first, 1000 * k + first + each):
            yield draw(np.random.default_rng(seed)).outcome(seed)


def main() -> None:
    """Print the tables."""
    count = how_many(QUICK if "--quick" in sys.argv else USUAL)
    only, first = option("only"), int(option("seed", str(SEED)))
    found = []
    diagnosed = (outcome(seed, one) for seed, one in drawn(count, only, first))
    for one in chain(diagnosed, of_navigators(count, only, first)):
        found.append(one)
        if not one.right:
            where = f"{one.label} (seed {one.seed})"
            print(f"{where}: {one.verdict} {one.named}", flush=True)
    printed(found)
