"""Recordings held against a simulator that has less, more, other sizes, or the same.

    python -m benchmarks against [PAIRS] [--seed=N]

The virtual device plays both, with noise of their own: 60 pairs, or as many as are
asked for. In turn something of the catalogue is concealed in the recording alone, in
the simulator alone, in both with other sizes, and in both alike or in neither. Printed
is how often it is named right, by an alias, with the right direction, how often
something is said that is not so, and how the recording is predicted before and after.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from benchmarks._words import how_many, option
from benchmarks.concealed import Draw, draws, kinds
from benchmarks.concealed.judging import AS_WELL
from benchmarks.concealed.sessions import Session
from fieldcal.against import Match, compare
from fieldcal.against.wording import is_direction_open
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Chain

USUAL, SEED = 60, 77_310_000
RELATIONS = ("left_out", "added", "resized", "equal")

LARGER = 2.5
"""By how much an effect is larger in one of two that both have it."""


@dataclass(frozen=True)
class Outcome:
    """What became of one pair.

    Attributes
    ----------
    relation, name : what was drawn
    named, aliased, directed : whether that is said, by an alias only, of the right one
    open : whether it is said that the direction is not certain
    false : whether anything is said that is not so
    before, after : chi^2 a degree of freedom of what is predicted
    seconds : of processor time

    """

    relation: str
    name: str
    named: bool
    aliased: bool
    directed: bool
    open: bool
    false: bool
    before: float
    after: float
    seconds: float


def drawn() -> list[tuple[str, Draw]]:
    """Names of the catalogue with what draws a session that has them."""
    every = {name: draw for name, (draw, _) in kinds().items() if name in catalogue()}
    return [(n, d) for n, d in every.items() if n != "earth_rate"]


def pair(session: Session, relation: str) -> tuple[Session, Session] | None:
    """Recording and simulator; None where an effect has no size to be changed."""
    if relation == "equal":
        return session, session
    (name,) = session.concealed
    bare = tuple(e for e in session.profile.effects if e.id != name)
    without = replace(
        session, profile=replace(session.profile, effects=bare), concealed={}
    )
    if relation == "left_out":
        return session, without
    if relation == "added":
        return without, session
    if isinstance(catalogue()[name], Chain):
        return None
    values = {
        n: v if n in draws.FIXED or isinstance(v, str) else LARGER * v
        for n, v in session.concealed[name].items()
    }
    return session.having({name: values}), session


def judged(relation: str, name: str, found: Match, seconds: float) -> Outcome:
    """Hold what is said against what was drawn."""
    said = [d for d in found.differences if name in (d.id, *d.aliases)]
    also = AS_WELL.get(name, frozenset())
    more = [d for d in found.differences if d not in said and d.id not in also]
    return Outcome(
        relation,
        name,
        any(d.id == name for d in said)
        if relation != "equal"
        else not found.differences,
        bool(said) and all(d.id != name for d in said),
        any(d.direction == relation for d in said),
        any(map(is_direction_open, said)),
        bool(more) or relation == "equal" and bool(said),
        found.before.chi2_per_dof,
        found.after.chi2_per_dof,
        seconds,
    )


def outcomes(count: int, first: int) -> Iterator[Outcome]:
    """Draw pairs, compare, and judge; what is not right is printed at once."""
    every, number, done = drawn(), 0, 0
    while done < count:
        (name, draw), relation = every[number % len(every)], RELATIONS[done % 4]
        seed, number = first + number, number + 1
        session = draw(np.random.default_rng(seed))
        both = pair(session, relation) if set(session.concealed) == {name} else None
        if both is None:
            continue
        real, sim = ((s.record(2 * seed + k), s.about) for k, s in enumerate(both))
        start = time.process_time()
        found = compare(real, sim)
        one = judged(relation, name, found, time.process_time() - start)
        done += 1
        heard = one.named or one.aliased
        wrong = relation != "equal" and not (one.directed or one.open)
        if one.false or not heard or wrong:
            told = [(d.id, d.direction, d.aliases) for d in found.differences]
            print(f"{relation} {name} (seed {seed}): {told}", flush=True)
        yield one


def printed(found: Sequence[Outcome]) -> None:
    """Print a row for each relation."""
    print("| drawn | pairs | named right | or by an alias | direction right, if told |"
          " not told | something false | χ²/dof before | after | s |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|")
    for relation in RELATIONS:
        some = [o for o in found if o.relation == relation]
        if not some:
            continue
        heard = [o for o in some if o.named or o.aliased]
        told = [o for o in heard if not o.open]
        shares = [
            np.mean([o.named for o in some]),
            np.mean([o.named or o.aliased for o in some]),
            np.mean([o.directed for o in told]) if told else np.nan,
            np.mean([o.open for o in heard]) if heard else np.nan,
            np.mean([o.false for o in some]),
        ]
        cells = [f"{100 * share:.1f} %" for share in shares]
        if relation == "equal":
            cells[1:4] = ["–"] * 3
        numbers = [
            np.median([getattr(o, n) for o in some]) for n in ("before", "after")
        ]
        cells += [f"{value:.2f}" for value in numbers]
        cells.append(f"{np.median([o.seconds for o in some]):.1f}")
        print(f"| {relation} | {len(some)} | {' | '.join(cells)} |")


def main() -> None:
    """Print the table, of those that are done if it is interrupted (ctrl-c)."""
    found: list[Outcome] = []
    with suppress(KeyboardInterrupt):
        found.extend(outcomes(how_many(USUAL), int(option("seed", str(SEED)))))
    printed(found)
