"""Which effects are there: a search that pays for what it tries.

A model is a set of hypotheses and a description of the random part. Its objective is

    ln Z - m (ln N + EXTRA)

with m hypotheses in it and N tried, less what sizes cost that are larger than is seen,
see `contender`. By Markov's inequality a term that is not there raises Z by a factor
exp(x) with a probability below exp(-x): with N tried and EXTRA on top, nothing enters a
recording that has nothing more often than exp(-EXTRA). Models grow by one or two at a
time, lose what has become idle, and swap. What is random (a walk, a scatter from window
to window, angles set by hand), and a smooth function that no effect makes, compete on
the same footing: a term has to beat them, not only white noise. Where evidence comes
near to a tie between chance and a cause, whichever predicts positions left out better
is taken.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.candidates import Hypothesis
from fieldcal.diagnosis.contender import Model, Rules, foretells
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.scatter import UNKNOWN, Wander, dropped, wanders
from fieldcal.diagnosis.variants import with_one
from fieldcal.diagnosis.whiten import nameless

EXTRA = 6.9
"""Of ln 1000."""

MARGIN, WEAK = 3.0, 8.0
"""How much better an effect has to be than something random, ln, if it is weak."""

TIE = 12.0
"""Difference in ln Z from which nothing is asked of positions left out."""

SEEN = 3.0
"""Times what is seen of an effect up to which nobody wonders at it."""

OTHERS = 60
"""Random and smooth parts that are tried besides."""

BEAM = 3
RIVAL = 0.3
"""Beginnings followed up have at least this part of the best one's gain."""

MOST = 6
"""Hypotheses in one model."""


class Search:
    """The search for one recording.

    Parameters
    ----------
    bench : rows with white noise only
    pool : the hypotheses
    always : terms that are in every model, and are not counted

    """

    def __init__(
        self, bench: Bench, pool: Sequence[Hypothesis], always: Sequence[Term] = ()
    ) -> None:
        self.bench, self.pool = bench, list(pool)
        self.price = float(np.log(len(self.pool) + OTHERS)) + EXTRA
        self.rules = Rules(tuple(always), self.price)
        self._grown: dict[tuple[frozenset[str], tuple[str, ...]], list[Model]] = {}

    def run(self) -> Model:
        """The best model found."""
        best = self.rules.model((), self.bench)
        seen = {best.parts}
        while (grown := self._grow(best)) is not None:
            best = self._tidied(self._anew(grown))
            if best.parts in seen:  # what was let in went again, or the other way about
                break
            seen.add(best.parts)
        return best

    def _grow(self, model: Model) -> Model | None:
        """The model with something more in it, if that is better."""
        if len(model.names) + len(model.random) >= MOST:
            return None
        chance = max(wanders(model.bench, model.fit), key=lambda w: w.gain)
        first = [*self.larger(model), *self._instead(model)]
        best = max(first, key=lambda m: m.objective, default=model)
        best = self._refitted(best)
        gain = best.objective - model.objective
        if max(gain, chance.gain - self.price) <= 0:
            return None
        # a fit that is not linear takes less of it than its linear part promises
        random = self.with_random(model, chance)
        by_chance = random.objective - model.objective
        if by_chance > gain - MARGIN or not best.leaves_nothing:
            best = self._refitted(self._followed(model, first))
            gain = best.objective - model.objective
        if by_chance > 0 and gain > 0 and abs(by_chance - gain) < TIE:
            strange = nameless(chance.name.partition(":")[0])
            return self._foretelling(model, first, best, random, strange)
        if by_chance > gain or (0 < gain < WEAK and by_chance > gain - MARGIN):
            return random if by_chance > 0 else None
        return best if gain > 0 else None

    def _foretelling(
        self,
        model: Model,
        first: Sequence[Model],
        best: Model,
        random: Model,
        strange: bool,
    ) -> Model:
        """Chance or a cause: whichever predicts the positions left out better.

        Where neither does clearly, evidence decides; a cause that leaves nothing comes
        before a function that no effect makes.
        """
        ranked = sorted(first, key=lambda m: -m.objective)[:BEAM]
        others = [self._refitted(m) for m in ranked if m.parts != best.parts]
        causes = [m for m in others if m.objective > model.objective]
        cause = max([best, *causes], key=foretells)
        more = foretells(cause) - foretells(random)
        if more > MARGIN:
            return cause
        likelier = best.objective >= random.objective
        known = strange and best.leaves_nothing and best.excess < SEEN
        if more < -(MARGIN + UNKNOWN * strange):
            return best if known and likelier else random
        return best if known or likelier else random

    def _refitted(self, model: Model) -> Model:
        """The model fitted with the axes and sizes that were chosen for its terms."""
        return self.rules.model(
            model.chosen, model.bench, model.fit, model.random, model.shaped
        )

    def _instead(self, model: Model) -> list[Model]:
        """With the likeliest causes, and the random parts as these leave them.

        A random part that was let in first has the size of all that was unexplained
        then; held against it, a cause would seem to explain next to nothing. It is made
        as small as a cause leaves it, or another takes its place.
        """
        if not model.random:
            return []
        bench = model.bench
        for name in model.random:
            bench = bench.but(errors=dropped(bench.errors, name))
        bare = self.rules.model(model.chosen, bench, model.fit, (), model.shaped)
        ranked = sorted(self.larger(bare), key=lambda m: -m.objective)[:BEAM]
        again = [
            self._anew(
                self.rules.model(m.chosen, model.bench, m.fit, model.random, m.shaped)
            )
            for m in ranked
        ]
        chances = [max(wanders(m.bench, m.fit), key=lambda w: w.gain) for m in ranked]
        pairs = zip(ranked, chances, strict=True)
        return again + [self.with_random(m, c) for m, c in pairs if c.gain > self.price]

    def _followed(self, model: Model, first: Sequence[Model]) -> Model:
        """The best of one or two more hypotheses."""
        ranked = sorted(first, key=lambda m: -m.objective)
        if not ranked:
            return model
        best = ranked[0]
        enough = RIVAL * (best.objective - model.objective)
        for start in ranked[:BEAM]:
            if start.objective - model.objective >= enough:
                more = self.larger(start)
                best = max([best, *more], key=lambda m: m.objective)
        return best

    def larger(self, model: Model) -> list[Model]:
        """The model with each hypothesis that it has not."""
        key = (model.names, model.random)
        if key not in self._grown:
            self._grown[key] = [
                self.with_one(model, h) for h in self.pool if h.name not in model.names
            ]
        return self._grown[key]

    def with_one(self, model: Model, hypothesis: Hypothesis) -> Model:
        """The model and the variant of a hypothesis that fits best with it."""
        return with_one(self.rules, model, hypothesis)

    def with_random(self, model: Model, chance: Wander) -> Model:
        """The model with something random let in."""
        bench = model.bench.but(errors=chance.errors)
        random = (*model.random, chance.name)
        return self.rules.model(model.chosen, bench, model.fit, random, model.shaped)

    def _tidied(self, model: Model) -> Model:
        """Without what has become idle, and with what does better swapped in."""
        for less in self.smaller(model):
            if less.objective > model.objective and not self._stays(model, less):
                return self._tidied(less)
            if len(model.chosen) > 1 and not model.random:
                swapped = max(self.larger(less), key=lambda m: m.objective)
                if swapped.objective > model.objective + 1e-6:
                    return self._tidied(swapped)
        return model

    def _stays(self, model: Model, less: Model) -> bool:
        """Whether a cause that chance could replace predicts the unseen better."""
        by_chance = model.random and less.random == model.random
        close = less.objective < model.objective + TIE
        more = foretells(model) - foretells(less) if by_chance and close else 0.0
        return more > MARGIN

    def rivals(self, model: Model) -> list[Model]:
        """Models with one hypothesis exchanged for another."""
        out = []
        named = [h.effect.id for h, _ in model.chosen if not h.known]
        for cause in dict.fromkeys(named):
            less = self.without(model, cause)
            parts = [h.part for h, _ in model.chosen if h.effect.id == cause]
            for one in self.larger(less):
                newest = one.chosen[-1][0]
                if newest.effect.id != cause and not newest.known:
                    out.append(self._whole(one, newest, parts))
        return out

    def without(self, model: Model, cause: str) -> Model:
        """The model without an effect, both its triads."""
        kept = [i for i, (h, _) in enumerate(model.chosen) if h.effect.id != cause]
        return self.rules.model(
            tuple(model.chosen[i] for i in kept),
            model.bench,
            model.fit,
            model.random,
            tuple(model.shaped[i] for i in kept),
        )

    def _whole(self, model: Model, newest: Hypothesis, parts: list[str]) -> Model:
        """The model with the other triads of its newest effect, as far as wanted."""
        for other in self.pool:
            if other.effect is newest.effect and other.part in parts:
                if other.name not in model.names:
                    model = self.with_one(model, other)
        return model

    def _anew(self, model: Model) -> Model:
        """With the random parts' sizes estimated beside what is in it now."""
        for name in model.random if model.chosen else ():
            bench = model.bench.but(errors=dropped(model.bench.errors, name))
            kept = tuple(r for r in model.random if r != name)
            less = self.rules.model(model.chosen, bench, model.fit, kept, model.shaped)
            chance = {w.name: w for w in wanders(bench, less.fit)}.get(name)
            model = self.with_random(less, chance) if chance else less
        return model

    def smaller(self, model: Model) -> list[Model]:
        """The model without each of its parts."""
        fitted, out = self.rules.model, []
        for i in range(len(model.chosen)):
            rest = model.chosen[:i] + model.chosen[i + 1 :]
            shaped = model.shaped[:i] + model.shaped[i + 1 :]
            out.append(fitted(rest, model.bench, model.fit, model.random, shaped))
        for name in model.random:
            kept = tuple(r for r in model.random if r != name)
            bench = model.bench.but(errors=dropped(model.bench.errors, name))
            out.append(fitted(model.chosen, bench, model.fit, kept, model.shaped))
        return out
