"""Whether the search finds a set as likely as the one that is there.

    python -m benchmarks optimum [SESSIONS] [--effects=2] [--seed=N]

Two effects or more (`--effects`) are concealed at once, in positions of the procedures
and in some that were laid by hand, of 5 deg each. The set of what is there, with the
parameters that suit it best, is compared with the set that was found. Where the data
do not tell them apart another set may be as likely. A set that is there and has a
higher weight than the one found was overlooked: the search ended in a local optimum.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from time import process_time
from typing import NamedTuple

import numpy as np

from benchmarks._words import how_many, option
from benchmarks.concealed import others
from benchmarks.concealed.sessions import Session
from fieldcal.diagnosis.explain import explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.search.inference import InferenceResult
from fieldcal.model.search.selection import Search
from fieldcal.model.search.variations import drop_superfluous

USUAL, EFFECTS, SEED = 40, 2, 77_000_000

SIGMAS = (10.0, 30.0)
"""Size of each effect, between."""

BY_HAND = 0.7
"""Share of sessions whose positions are laid by hand."""

NEARLY = 0.5
"""By how much a set must be likelier to count as overlooked, ln."""

MOST_VARIANTS, ROUNDS = 80, 3
"""Variants of a cause that are tried one by one, and how often each is tried again."""


class Compared(NamedTuple):
    """What is there and what was found in one session.

    `there` is None if the dictionary of the session lacks one of the effects.
    """

    concealed: tuple[str, ...]
    found: Set
    there: Set | None
    seconds: float

    @property
    def right(self) -> bool:
        """Whether the set that was found has every effect that is there."""
        return set(self.concealed) <= {cause.name for cause, _ in self.found.members}

    @property
    def overlooked(self) -> float:
        """By how much the set that is there is likelier, ln; 0 if it is not."""
        if self.there is None:
            return 0.0
        return max(0.0, self.there.score - self.found.score)


def drawn(rng: np.random.Generator, count: int) -> Session:
    """A session with effects of which no two are alike."""
    sigmas = float(np.exp(rng.uniform(*np.log(SIGMAS))))
    session = others.several(rng, sigmas, count)
    if rng.random() > BY_HAND:
        return session
    laid = np.deg2rad(5.0) * np.stack(
        [rng.integers(-36, 37, len(session.windows)),
         rng.integers(-17, 18, len(session.windows))], axis=1
    )  # fmt: skip
    windows = tuple(
        replace(w, alpha=alpha, beta=beta)
        for w, (alpha, beta) in zip(session.windows, laid.tolist(), strict=True)
    )
    return replace(session, windows=windows)


def compared(session: Session, seed: int) -> Compared:
    """What was found, and what is there with its best parameters."""
    begin = process_time()
    inferred = explain(prepare_recording(session.record(seed), session.about)).inferred
    seconds = process_time() - begin
    names = tuple(session.concealed)
    return Compared(names, inferred.best, best_of_these(inferred, names), seconds)


def best_of_these(inferred: InferenceResult, names: tuple[str, ...]) -> Set | None:
    """The likeliest set with these effects, alone or beside what else was found."""
    search, members = inferred.search, []
    for name in names:
        causes = [c for c in inferred.fit.dictionary.causes if c.name == name]
        if not causes:
            return None
        alone = [search.sets.evaluate(((c, c.variants[0]),)) for c in causes]
        members.append(max(alone, key=_weight).members[0])
    beside = [m for m in inferred.best.members
              if m[0].kind == "effect" and m[0].name not in names]  # fmt: skip
    starts = [members, [*members, *beside]] if beside else [members]
    return max((_settled(search, tuple(start)) for start in starts), key=_weight)


def _settled(search: Search, members: tuple[Member, ...]) -> Set:
    """The set with those parameters of each cause that raise its weight most."""
    best = search.sets.evaluate(members)
    for _ in range(ROUNDS):
        before = best.score
        for i in range(len(members)):
            best = max(_varied(search, best, i), key=_weight)
        if best.score <= before:
            break
    return drop_superfluous(search.sets, best.members)


def _varied(search: Search, there: Set, i: int) -> Iterator[Set]:
    """The set, and the set with other parameters of one of its causes."""
    yield there
    cause, _ = there.members[i]
    if len(cause.variants) > MOST_VARIANTS:
        return
    for group in cause.variants:
        members = list(there.members)
        members[i] = (cause, group)
        yield search.sets.evaluate(tuple(members), there.sizes)


def _weight(one: Set) -> float:
    return one.score


def main() -> None:
    """Compare, and print a table."""
    sessions, count = how_many(USUAL), int(option("effects", str(EFFECTS)))
    first = int(option("seed", str(SEED)))
    every = []
    for seed in range(first, first + sessions):
        one = compared(drawn(np.random.default_rng(seed), count), seed)
        every.append(one)
        if one.overlooked > NEARLY and one.there is not None:
            print(
                f"{seed}: {' + '.join(sorted(one.there.keys))} is likelier than"
                f" {' + '.join(sorted(one.found.keys))} by {one.overlooked:.1f} (ln)"
            )
    right = sum(one.right for one in every)
    missed = sum(one.overlooked > NEARLY for one in every)
    unknown = sum(one.there is None for one in every)
    print(f"| effects at once | {count} |", "|---|---|", sep="\n")
    print(f"| sessions | {len(every)} |")
    print(f"| every effect that is there is in the set found | {right} |")
    print(f"| the set that is there is likelier than the one found | {missed} |")
    print(f"| an effect is not among those considered | {unknown} |")
    seconds = np.median([one.seconds for one in every])
    print(f"| processor time of a search, median | {seconds:.1f} s |")
