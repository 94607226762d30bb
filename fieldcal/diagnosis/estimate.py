"""Numbers for the effects that were chosen.

The search works with priors of typical size; the numbers that are reported come from
priors RELAX times wider, so that they are not drawn to zero, with shape parameters
estimated along. Parameters that the rows leave open are taken out, the last first,
until all that remain are determined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.scatter import cautious

RELAX = 20.0


def estimate(
    bench: Bench, terms: Sequence[Term], near: Fit
) -> tuple[Bench, Fit, tuple[str, ...]]:
    """Fit with wide priors, and with all the scatter that there may be.

    Returns
    -------
    wide : rows with those priors and errors
    fit : with determined effects only
    left : names of parameters that the rows leave open

    """
    wide = bench.but(relax=RELAX)
    wide = wide.but(errors=cautious(wide, wide.fit(terms, near)))
    now = [_free(t) for t in terms]
    left: list[str] = []
    while True:
        fit = wide.fit(now, near)
        open_ = _open(fit, now)
        if open_ is None:
            return wide, fit, tuple(left)
        i, j = open_
        left.append(f"{now[i].effect.id}.{now[i].effect.params[j].name}")
        kept = tuple(c for c in now[i].columns if c != j)
        now[i] = replace(now[i], columns=kept)
        if not kept:
            del now[i]


def _free(term: Term) -> Term:
    smooth = term.shape and "at_s" not in term.shape and term.columns
    return replace(term, free_shape=bool(smooth), tight=1.0)


def _open(fit: Fit, terms: Sequence[Term]) -> tuple[int, int] | None:
    """Term and parameter of the last column that the rows leave open."""
    for i in reversed(range(len(terms))):
        for j in reversed(terms[i].columns):
            name = f"{terms[i].effect.id}.{terms[i].effect.params[j].name}"
            if not fit.determined[fit.names.index(name)]:
                return i, j
    return None


def sigmas(fit: Fit, term: Term) -> dict[str, tuple[float, float]]:
    """Value (with what the simulation has already) and sigma of a term's parameters."""
    full = term.full(fit.state.values[fit.terms.index(term)])
    out = {}
    for j in term.columns:
        name = term.effect.params[j].name
        at = fit.names.index(f"{term.effect.id}.{name}")
        out[name] = (float(full[j]), float(fit.sigma[at]))
    if term.free_shape:
        values = fit.state.values[fit.terms.index(term)][len(term.columns) :]
        for name, value in zip(term.shape, values, strict=True):
            at = fit.names.index(f"{term.effect.id}.{name}")
            out[name] = (float(value), float(fit.sigma[at]))
    return out
