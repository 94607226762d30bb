"""Which effects are there: a search that pays for what it tries.

A model is a set of hypotheses and a description of the random part. Its objective is

    ln Z - m (ln N + EXTRA)

with m hypotheses in it and N tried. By Markov's inequality a term that is not there
raises Z by a factor exp(x) with a probability below exp(-x): with N tried and EXTRA on
top, nothing enters a recording that has nothing more often than exp(-EXTRA). Models
grow by one or two at a time, lose what has become idle, and swap. What is random (a
walk, a scatter from window to window, angles set by hand), and a smooth function that
no effect makes, compete on the same footing: a term has to beat them, not only white
noise. Where evidence comes near to a tie between chance and a cause, whichever predicts
positions left out better is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.diagnosis.candidates import Hypothesis, instants
from fieldcal.diagnosis.fit import Bench, Fit
from fieldcal.diagnosis.heldout import foretold
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.narrow import narrower
from fieldcal.diagnosis.scatter import Wander, dropped, fees, wanders
from fieldcal.diagnosis.steps import step_gains

EXTRA = 6.9
"""Of ln 1000."""

MARGIN, WEAK = 3.0, 8.0
"""How much better an effect has to be than something random, ln, if it is weak."""

TIE = 12.0
"""Difference in ln Z from which nothing is asked of positions left out."""

OTHERS = 60
"""Random and smooth parts that are tried besides."""

BEAM = 3
RIVAL = 0.3
"""Beginnings followed up have at least this part of the best one's gain."""

AGAIN = 3.0
"""What the second triad costs of an effect that the first has already, ln."""

MOST = 6
"""Hypotheses in one model."""

STEPS = 3
LEAVES = 4.0
"""Standard deviations of chi^2 from which a fit leaves something to explain."""

Choice = tuple[Hypothesis, Term]


@dataclass(frozen=True, slots=True)
class Model:
    """Hypotheses with their fit.

    Attributes
    ----------
    chosen : hypotheses, each with the variant that fits best
    bench : rows with the errors of this model
    fit : at the optimum
    objective : ln Z less what the hypotheses cost
    random : names of the random parts that were let in
    shaped : what the choice of variants cost, ln

    """

    chosen: tuple[Choice, ...]
    bench: Bench
    fit: Fit
    objective: float
    random: tuple[str, ...] = ()
    shaped: tuple[float, ...] = ()

    @property
    def names(self) -> frozenset[str]:
        """Names of the hypotheses in it."""
        return frozenset(h.name for h, _ in self.chosen)

    @property
    def parts(self) -> frozenset[str]:
        """Names of everything in it, causes and random parts."""
        return self.names | {*self.random}

    @property
    def leaves_nothing(self) -> bool:
        """Whether its rows are no further off than white noise."""
        spread = np.sqrt(2 * max(self.fit.dof, 1))
        return self.fit.chi2 < self.fit.dof + LEAVES * float(spread)


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
        self.bench, self.pool, self.always = bench, list(pool), tuple(always)
        self.price = float(np.log(len(self.pool) + OTHERS)) + EXTRA
        self._grown: dict[tuple[frozenset[str], tuple[str, ...]], list[Model]] = {}

    def run(self) -> Model:
        """The best model found."""
        best = self.model((), self.bench)
        seen = {best.parts}
        while (grown := self._grow(best)) is not None:
            grown = self.model(
                grown.chosen, grown.bench, grown.fit, grown.random, grown.shaped
            )
            best = self._tidied(self._anew(grown))
            if best.parts in seen:  # what was let in went again, or the other way about
                break
            seen.add(best.parts)
        return best

    def model(
        self,
        chosen: tuple[Choice, ...],
        bench: Bench,
        near: Fit | None = None,
        random: tuple[str, ...] = (),
        shaped: tuple[float, ...] = (),
    ) -> Model:
        """Fit some hypotheses."""
        fit = bench.fit([*self.always, *(t for _, t in chosen)], near)
        new = {h.effect.id for h, _ in chosen if not h.known}
        again = sum(not h.known for h, _ in chosen) - len(new)
        cost = self.price * (len(new) + len(random)) + AGAIN * again + sum(shaped)
        cost += fees(bench.errors)
        return Model(chosen, bench, fit, fit.score - cost, random, shaped)

    def _grow(self, model: Model) -> Model | None:
        """The model with something more in it, if that is better."""
        if len(model.names) + len(model.random) >= MOST:
            return None
        chance = max(wanders(model.bench, model.fit), key=lambda w: w.gain)
        first = [*self.larger(model), *self._instead(model)]
        best = max(first, key=lambda m: m.objective, default=model)
        gain = best.objective - model.objective
        if max(gain, chance.gain - self.price) <= 0:
            return None
        # a fit that is not linear takes less of it than its linear part promises
        random = self.with_random(model, chance)
        by_chance = random.objective - model.objective
        if by_chance > gain - MARGIN or not best.leaves_nothing:
            best = self._followed(model, first)
            gain = best.objective - model.objective
        if by_chance > 0 and gain > 0 and abs(by_chance - gain) < TIE:
            return self._foretelling(model, first, best, random)
        if by_chance > gain or (0 < gain < WEAK and by_chance > gain - MARGIN):
            return random if by_chance > 0 else None
        return best if gain > 0 else None

    def _foretelling(
        self, model: Model, first: Sequence[Model], best: Model, random: Model
    ) -> Model:
        """Chance or a cause: whichever predicts the positions left out better."""
        ranked = sorted(first, key=lambda m: -m.objective)[:BEAM]
        causes = [m for m in ranked if m.objective > model.objective and m is not best]
        cause = max([best, *causes], key=foretells)
        more = foretells(cause) - foretells(random)
        if more > MARGIN:
            return cause
        return random if more < -MARGIN or random.objective > best.objective else best

    def _instead(self, model: Model) -> list[Model]:
        """With the likeliest causes, and the random parts as small as these leave them.

        A random part that was let in first has the size of all that was unexplained
        then; held against it, a cause would seem to explain next to nothing.
        """
        if not model.random:
            return []
        bench = model.bench
        for name in model.random:
            bench = bench.but(errors=dropped(bench.errors, name))
        bare = self.model(model.chosen, bench, model.fit, (), model.shaped)
        ranked = sorted(self.larger(bare), key=lambda m: -m.objective)[:BEAM]
        return [
            self._anew(self.model(m.chosen, model.bench, m.fit, model.random, m.shaped))
            for m in ranked
        ]

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
        """The model and the variant of a hypothesis that fits best with it.

        Several variants are one hypothesis: their mean likelihood counts.
        """
        variants, cost = hypothesis.variants, hypothesis.cost
        there = [t for h, t in model.chosen if h.effect is hypothesis.effect]
        if there and there[0].shape:
            variants = (replace(variants[0], shape=there[0].shape),)
        if "at_s" in variants[0].shape and not there:
            variants, more = self._jumps(model, hypothesis)
            cost += more
        tried = [
            narrowed(
                self.model(
                    (*model.chosen, (hypothesis, term)),
                    model.bench,
                    model.fit,
                    model.random,
                    (*model.shaped, cost),
                )
            )
            for term in variants
        ]
        best = max(tried, key=lambda m: m.objective)
        if "at_s" in variants[0].shape or len(tried) == 1:
            return best
        relative = np.array([m.objective for m in tried]) - best.objective
        more = -float(np.log(np.mean(np.exp(relative))))
        shaped = (*model.shaped, best.shaped[-1] + more)
        return replace(best, objective=best.objective - more, shaped=shaped)

    def _jumps(
        self, model: Model, hypothesis: Hypothesis
    ) -> tuple[tuple[Term, ...], float]:
        """The likeliest instants of a jump, and what choosing among all costs."""
        term = hypothesis.variants[0]
        channels = term.columns
        gains = step_gains(model.bench, model.fit, channels, term.prior)
        best = np.argsort(gains)[::-1][:STEPS]
        cost = -float(np.log(np.mean(np.exp(gains - gains.max()))))
        at = instants(model.bench)
        return tuple(replace(term, shape={"at_s": float(at[i])}) for i in best), cost

    def with_random(self, model: Model, chance: Wander) -> Model:
        """The model with something random let in."""
        bench = model.bench.but(errors=chance.errors)
        random = (*model.random, chance.name)
        return self.model(model.chosen, bench, model.fit, random, model.shaped)

    def _tidied(self, model: Model) -> Model:
        """Without what has become idle, and with what does better swapped in."""
        for less in self.smaller(model):
            if less.objective > model.objective:
                return self._tidied(less)
            if len(model.chosen) > 1 and not model.random:
                swapped = max(self.larger(less), key=lambda m: m.objective)
                if swapped.objective > model.objective + 1e-6:
                    return self._tidied(swapped)
        return model

    def rivals(self, model: Model) -> list[Model]:
        """Models with one hypothesis exchanged for another."""
        out = []
        for cause in {h.effect.id for h, _ in model.chosen if not h.known}:
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
        return self.model(
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
            less = self.model(model.chosen, bench, model.fit, kept, model.shaped)
            chance = {w.name: w for w in wanders(bench, less.fit)}.get(name)
            model = self.with_random(less, chance) if chance else less
        return model

    def smaller(self, model: Model) -> list[Model]:
        """The model without each of its parts."""
        out = []
        for i in range(len(model.chosen)):
            rest = model.chosen[:i] + model.chosen[i + 1 :]
            shaped = model.shaped[:i] + model.shaped[i + 1 :]
            out.append(self.model(rest, model.bench, model.fit, model.random, shaped))
        for name in model.random:
            kept = tuple(r for r in model.random if r != name)
            bench = model.bench.but(errors=dropped(model.bench.errors, name))
            out.append(self.model(model.chosen, bench, model.fit, kept, model.shaped))
        return out


def foretells(model: Model) -> float:
    """How well a model predicts positions left out, ln."""
    return foretold(model.bench, model.fit.terms, model.fit)


def narrowed(model: Model) -> Model:
    """With the newest term on the axes, and of the size, that serve it best."""
    hypothesis, term = model.chosen[-1]
    columns, tight, more, cost = narrower(model.bench, model.fit, term)
    new = replace(term, columns=columns, tight=tight)
    return replace(
        model,
        chosen=(*model.chosen[:-1], (hypothesis, new)),
        objective=model.objective + more - cost,
        shaped=(*model.shaped[:-1], model.shaped[-1] + cost),
    )
