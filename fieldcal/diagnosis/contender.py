"""A model of a recording: hypotheses, a description of the random part, their price.

    objective = ln Z - m (ln N + EXTRA) - what the choice of variants cost
                - RARE sum ln(largest value of an effect / what is seen of it)

with m hypotheses in the model and N tried; ln Z is that of `fit`. The last sum goes
over effects that are larger than is seen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.candidates import Hypothesis
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.heldout import foretold
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.scatter import fees
from fieldcal.samples import Array

AGAIN = 3.0
"""What the second triad costs of an effect that the first has already, ln."""

RARE = 4.0
"""Devices that have an effect x times what is seen are as rare as x to the minus this.

A function that no effect makes wanders by its size likewise, see `scatter.fees`.
"""

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
    def excess(self) -> float:
        """Largest value of an effect in it, in what is the most that is seen."""
        return float(_excess(self.bench, self.fit).max())

    @property
    def leaves_nothing(self) -> bool:
        """Whether its rows are no further off than white noise."""
        spread = np.sqrt(2 * max(self.fit.dof, 1))
        return self.fit.chi2 < self.fit.dof + LEAVES * float(spread)


@dataclass(frozen=True, slots=True)
class Rules:
    """What all models of one search have in common.

    `always` are terms that are in every model, and are not counted; `price` is what
    each hypothesis costs, ln.
    """

    always: tuple[Term, ...]
    price: float

    def model(
        self,
        chosen: tuple[Choice, ...],
        bench: Bench,
        near: Fit | None = None,
        random: tuple[str, ...] = (),
        shaped: tuple[float, ...] = (),
    ) -> Model:
        """Fit some hypotheses."""
        terms = [*self.always, *(t for _, t in chosen)]
        fit = bench.fit(terms, near, rough=True)
        new = {h.effect.id for h, _ in chosen if not h.known}
        again = sum(not h.known for h, _ in chosen) - len(new)
        cost = self.price * (len(new) + len(random)) + AGAIN * again + sum(shaped)
        cost += fees(bench.errors)
        cost += RARE * float(np.log(np.maximum(_excess(bench, fit), 1.0)).sum())
        return Model(chosen, bench, fit, fit.score - cost, random, shaped)


def _excess(bench: Bench, fit: Fit) -> Array:
    """Largest value of each effect, in what is the most that is seen of it, (m,)."""
    out = [0.0]
    for term, values in zip(fit.state.terms, fit.state.values, strict=True):
        many = len(term.columns)
        ratio = term.tight * np.abs(values[:many]) / bench.prior_of(term)[:many]
        out.append(float(ratio.max(initial=0.0)))
    return np.array(out)


def foretells(model: Model) -> float:
    """How well a model predicts positions left out, ln."""
    return foretold(model.bench, model.fit.terms, model.fit)


def charged(model: Model, cost: float) -> Model:
    """The model when choosing its newest variant costs so much more, ln."""
    shaped = (*model.shaped[:-1], model.shaped[-1] + cost)
    return replace(model, objective=model.objective - cost, shaped=shaped)
