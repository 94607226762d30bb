"""Which variant of a hypothesis fits best: its axes, its size, its shape.

Several variants are one hypothesis: their mean likelihood counts. Over the range of a
shape parameter, on a logarithmic scale, that is the mean over a grid, or, where the
peak is narrower than the grid's steps, its area in Laplace's approximation,

    ln L^ - ln(R / (sqrt(2 pi) s)),    R = ln(high / low), s = sigma(ln tau)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.diagnosis.candidates import Hypothesis, instants
from fieldcal.diagnosis.contender import Model, Rules, charged
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.narrow import narrower
from fieldcal.diagnosis.steps import step_gains
from fieldcal.effects import Motion

STEPS = 3
"""Instants of a jump that are fitted."""


def with_one(rules: Rules, model: Model, hypothesis: Hypothesis) -> Model:
    """The model and the variant of a hypothesis that fits best with it."""
    variants, cost = hypothesis.variants, hypothesis.cost
    there = [t for h, t in model.chosen if h.effect is hypothesis.effect]
    if there and there[0].shape:
        variants = (replace(variants[0], shape=there[0].shape),)
    jumps = "at_s" in variants[0].shape
    if jumps and not there:
        likely, more = _jumps(model, hypothesis)
        variants = tuple(likely)
        cost += more
    wide = [_and(rules, model, (hypothesis, v), cost) for v in variants]
    tried = [_narrowed(rules, m) for m in wide]
    best = max(tried, key=lambda m: m.objective)
    if jumps or len(tried) == 1:
        return best
    relative = np.array([m.objective for m in tried]) - best.objective
    on_grid = charged(best, -float(np.log(np.mean(np.exp(relative)))))
    if best.objective < model.objective:
        return on_grid
    return max(on_grid, _sharper(rules, model, best), key=lambda m: m.objective)


def _and(
    rules: Rules, model: Model, choice: tuple[Hypothesis, Term], cost: float
) -> Model:
    """The model with one hypothesis more."""
    return rules.model(
        (*model.chosen, choice),
        model.bench,
        model.fit,
        model.random,
        (*model.shaped, cost),
    )


def _sharper(rules: Rules, model: Model, best: Model) -> Model:
    """With the best variant's shape where it fits best, between those of a grid."""
    hypothesis, term = best.chosen[-1]
    free = (hypothesis, replace(term, free_shape=True))
    fit = _and(rules, model, free, 0.0).fit
    (name,) = term.shape
    at = fit.column(f"{term.effect.id}.{name}")
    tried = [v.shape[name] for v in hypothesis.variants]
    tau = float(np.clip(fit.values[at], min(tried), max(tried)))
    width = float(fit.sigma[at]) / tau * np.sqrt(2 * np.pi)
    area = float(np.log(np.log(max(tried) / min(tried)) / width))
    cost = best.shaped[-1] + max(area, 0.0)
    return _and(rules, model, (hypothesis, replace(term, shape={name: tau})), cost)


def _jumps(model: Model, hypothesis: Hypothesis) -> tuple[Sequence[Term], float]:
    """The likeliest instants of a jump, and what choosing among all costs."""
    term = hypothesis.variants[0]
    gains = step_gains(model.bench, model.fit, term.columns, term.prior)
    best = np.argsort(gains)[::-1][:STEPS]
    cost = -float(np.log(np.mean(np.exp(gains - gains.max()))))
    at = instants(model.bench)
    return [replace(term, shape={"at_s": float(at[i])}) for i in best], cost


def _narrowed(rules: Rules, model: Model) -> Model:
    """With the newest term on the axes, and of the size, that serve it best.

    What moves the device multiplies with scale factors; where these are not known, the
    linear estimate of what another size is worth may be far off, and does not count.
    """
    hypothesis, term = model.chosen[-1]
    columns, tight, more, cost = narrower(model.bench, model.fit, term)
    new = replace(term, columns=columns, tight=tight)
    better = replace(
        model,
        chosen=(*model.chosen[:-1], (hypothesis, new)),
        objective=model.objective + more,
    )
    better = charged(better, cost)
    if tight != 1.0 and isinstance(term.effect, Motion):
        fitted = rules.model(
            better.chosen, model.bench, model.fit, model.random, better.shaped
        )
        return fitted if fitted.objective > model.objective else model
    return better
