"""Which processes a channel has: those that predict held-out coefficients.

A process is added or removed by the score of held-out coefficients (`likelihood`): it
is accepted if the gain exceeds its standard error. If the processes do not explain the
scatter of the powers, all uncertainties are enlarged by that dispersion.

Source of the rule: Breiman et al. 1984, one standard error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.noise.device_filter import without_filter
from fieldcal.noise.fit_quality import (
    dispersion_of_bins,
    predicts_better,
)
from fieldcal.noise.likelihood import (
    TIMED_TERMS,
    NoiseFit,
    Powers,
    fit_processes,
)
from fieldcal.noise.reference import most_probable_sizes
from fieldcal.noise.spectrum import CosineSpectrum
from fieldcal.noise.untimed_terms import fit_white_noise

MOST_MARKOV = 2
NEGLIGIBLE = 0.01
STARTS = 6
"""Correlation times with which the fit of a Gauss-Markov process begins."""


@dataclass(frozen=True, slots=True)
class ChosenProcesses:
    """The processes of a channel.

    Attributes
    ----------
    best : the chosen processes at their most probable sizes
    weighted_fits : (weight, fit) of all sets that predict well, the chosen one among
        them, at their most probable sizes; the sum of weights is 1
    powers : to which they were fitted
    dispersion : scatter of the powers relative to that by the processes alone, as a
        factor of variance; at least 1

    """

    best: NoiseFit
    weighted_fits: tuple[tuple[float, NoiseFit], ...]
    powers: Powers
    dispersion: float


def choose_processes(spectrum: CosineSpectrum, powers: Powers) -> ChosenProcesses:
    """Choose the processes of a channel."""
    powers = without_filter(spectrum, powers)
    best, seen = grow_set(spectrum, powers)
    dispersion = dispersion_of_bins(powers, best)
    if dispersion > 1:
        powers = powers.scaled(dispersion)
        best, seen = grow_set(spectrum, powers)
    others = [
        (weight, most_probable_sizes(spectrum, powers, one))
        for weight, one in _weighted_by_prediction(seen)
    ]
    best = most_probable_sizes(spectrum, powers, best)
    return ChosenProcesses(best, tuple(others), powers, dispersion)


def _weighted_by_prediction(fits: list[NoiseFit]) -> tuple[tuple[float, NoiseFit], ...]:
    """Each set of processes once, weighted by its predictions (Geisser, Eddy 1979)."""
    sets = {tuple(sorted(f.terms)): f for f in fits}
    scores = np.array([f.scores.sum() for f in sets.values()])
    weights = np.exp(scores - scores.max())
    kept = weights > NEGLIGIBLE * weights.max()
    total = weights[kept].sum()
    return tuple(
        (float(w / total), f)
        for w, f, k in zip(weights, sets.values(), kept, strict=True)
        if k
    )


def grow_set(
    spectrum: CosineSpectrum, powers: Powers
) -> tuple[NoiseFit, list[NoiseFit]]:
    """Add and remove processes until the predictions do not improve.

    Returns the best fit, and all fits that were tried.
    """
    best = fit_white_noise(spectrum, powers)
    seen = [best]
    while True:
        tried = [
            _with_process(spectrum, powers, best, new) for new in _additions(best.terms)
        ]
        every = [f for f in [*tried, _with_two_processes(spectrum, powers, best)] if f]
        seen += every
        more = [f for f in every if predicts_better(f, best)]
        if not more:
            break
        best = max(more, key=lambda f: float(f.scores.sum()))
    for place in range(1, len(best.terms)):  # white noise is always there
        less = _without_process(best, place)
        if found := fit_processes(spectrum, powers, less.terms, less.x):
            seen.append(found)
    return _simplest(seen), seen


def _simplest(fits: list[NoiseFit]) -> NoiseFit:
    """The fit with fewest parameters that no other predicts clearly better than."""
    best = max(fits, key=lambda f: float(f.scores.sum()))
    fewer = [f for f in fits if len(f.x) < len(best.x) and not predicts_better(best, f)]
    return _simplest(fewer) if fewer else best


def _additions(terms: tuple[str, ...]) -> list[str]:
    """Processes that may be added to a set."""
    new = [t for t in ("K", "Q") if t not in terms]
    if "B" in terms:
        new.append("BT")
    elif "BT" not in terms:
        new.append("B")
    if terms.count("G") < MOST_MARKOV:
        new.append("G")
    return new


def _with_process(
    spectrum: CosineSpectrum, powers: Powers, old: NoiseFit, new: str
) -> NoiseFit | None:
    """The most likely fit with one more process, or with a cut-off of flicker."""
    low, high = spectrum.log_times
    if new not in TIMED_TERMS:
        return _fit_from_residual(spectrum, powers, old, new, None)
    kept = old
    if new == "BT":
        place = old.terms.index("B")
        kept = _without_process(old, place)
    tries = np.linspace(low, high, STARTS + 2)[1:-1]
    found = [_fit_from_residual(spectrum, powers, kept, new, float(t)) for t in tries]
    return max((f for f in found if f), key=lambda f: f.log_likelihood, default=None)


def _fit_from_residual(
    spectrum: CosineSpectrum,
    powers: Powers,
    old: NoiseFit,
    new: str,
    log_time: float | None,
) -> NoiseFit | None:
    """Fit with a new process, beginning with the size that explains the residual."""
    if log_time is None:
        column = spectrum.column(new)
    else:
        of = spectrum.markov if new == "G" else spectrum.flicker
        column = of(log_time)[0]
    used = ~powers.free
    count = powers.count[used].sum(axis=1)
    share = column[used] / old.level[used]
    left = powers.power[used].sum(axis=1) / old.level[used] - count
    size = float(share @ left / (share**2 @ count))
    least = 0.02 / float(share.max())
    sizes, times = old.x[: len(old.terms)], old.x[len(old.terms) :]
    new_time = [] if log_time is None else [log_time]
    start = np.concatenate([sizes, [np.log(max(size, least))], times, new_time])
    return fit_processes(spectrum, powers, (*old.terms, new), start)


def _without_process(old: NoiseFit, place: int) -> NoiseFit:
    """The fit without one process, not fitted again."""
    keep = [i for i in range(len(old.terms)) if i != place]
    if old.terms[place] in TIMED_TERMS:
        gone = len(old.terms) + old.timed.index(place)
    else:
        gone = -1
    times = [i for i in range(len(old.terms), len(old.x)) if i != gone]
    return replace(
        old, terms=tuple(old.terms[i] for i in keep), x=old.x[[*keep, *times]]
    )


def _with_two_processes(
    spectrum: CosineSpectrum, powers: Powers, best: NoiseFit
) -> NoiseFit | None:
    """Fit with two more processes, neither of which may help alone."""
    new = [t for t in ("K", "B") if t not in best.terms and t + "T" not in best.terms]
    if len(new) < 2:
        return None
    one = _with_process(spectrum, powers, best, new[0])
    return one and _with_process(spectrum, powers, one, new[1])
