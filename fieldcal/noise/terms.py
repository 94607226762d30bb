"""Which processes a channel has: those that predict held-out coefficients.

A process is added or removed by the score of held-out coefficients (`likelihood`): it
is accepted if the gain exceeds its standard error. Above 1 Hz, where a device filters
its outputs and machines hum, bins can have a level of their own instead: the noise of
windows of seconds is below. If the processes do not explain the scatter of the powers,
all uncertainties are enlarged by that dispersion.

Source of the rule: Breiman et al. 1984, one standard error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import (
    TIMED_TERMS,
    Flags,
    NoiseFit,
    Powers,
    expected_powers,
    fit_processes,
)
from fieldcal.noise.reference import most_probable_sizes
from fieldcal.noise.spectrum import CosineSpectrum

FILTERED_HZ = 1.0
"""Lowest corner frequency of a device's filter, Hz."""

BENT = 2.5
"""Standard errors by which an octave is off that a filter bends."""

MIN_LEFT = 500
"""Fewest coefficients that are left: they tell white noise to 3 %."""

FOLDED = 0.02
"""Largest part of its white noise that a bin may have from beyond a corner."""

UNTIMED_TERMS = ("N", "Q", "B", "K")
MOST_MARKOV = 2
NEGLIGIBLE = 0.01
MULTIPLIED = 100
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
    dispersion = _dispersion(powers, best)
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
    best = _white_only(spectrum, powers)
    seen = [best]
    while True:
        tried = [
            _with_process(spectrum, powers, best, new) for new in _additions(best.terms)
        ]
        every = [f for f in [*tried, _with_two_processes(spectrum, powers, best)] if f]
        seen += every
        more = [f for f in every if _better(f, best)]
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
    fewer = [f for f in fits if len(f.x) < len(best.x) and not _better(best, f)]
    return _simplest(fewer) if fewer else best


def _white_only(spectrum: CosineSpectrum, powers: Powers) -> NoiseFit:
    used = ~powers.free
    column = spectrum.fixed_columns["N"][used]
    total = (powers.power[used].sum(axis=1) / column).sum() / powers.count[used].sum()
    # white noise alone
    found = fit_processes(spectrum, powers, ("N",), np.log([total]))
    if found is None:
        raise AssertionError("white noise is in every bin")
    return found


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


def _better(more: NoiseFit, less: NoiseFit) -> bool:
    """Whether the gain of held-out coefficients exceeds its standard error.

    Twice the gain in likelihood is noncentral chi squared: its standard error is twice
    its root.
    """
    gain = float((more.scores - less.scores).sum())
    likely = max(more.log_likelihood - less.log_likelihood, 0.0)
    return bool(gain > np.sqrt(2 * likely))


def without_filter(spectrum: CosineSpectrum, powers: Powers) -> Powers:
    """Leave bins above a corner out of the fit, if that predicts better."""
    top = spectrum.frequency.max()
    best, chosen = fit_untimed_terms(spectrum, powers), powers
    corner = top / 2
    while corner >= FILTERED_HZ:
        free = powers.free | (spectrum.frequency > corner)
        tried = replace(powers, free=free)
        found = fit_untimed_terms(spectrum, tried)
        if _better(found, best):
            best, chosen = found, tried
        corner /= 2
    filtered = chosen is not powers
    chosen = _without_lines(spectrum, chosen, best)
    while (octave := _octave(spectrum, chosen)).any():
        below = replace(chosen, free=chosen.free | octave)
        if abs(_excess_above(spectrum, chosen, below)) < BENT:
            break
        chosen, filtered = below, True
    return _without_bend(spectrum, chosen) if filtered else chosen


def _without_bend(spectrum: CosineSpectrum, powers: Powers) -> Powers:
    """Leave out what a filter takes from bins below those that show it.

    In each bin that is too little to be seen, and in all of them it is several standard
    errors of the white noise. It is the bend of the next octave, and in means over
    several samples the part of white noise that is folded from beyond the corner, where
    a filtered device has none. Where too little would be left, white noise is not known
    well enough for it to matter.
    """
    free = powers.free | _octave(spectrum, powers)
    corner = float(spectrum.frequency[~free].max())
    lacking = (spectrum.folded_share > FOLDED) & (spectrum.folded_from > corner)
    left = replace(powers, free=free | lacking)
    return left if left.count[~left.free].sum() >= MIN_LEFT else powers


def _octave(spectrum: CosineSpectrum, powers: Powers) -> Flags:
    """The highest octave of the bins that are fitted; none below a filter's corner."""
    used = ~powers.free
    corner = float(spectrum.frequency[used].max()) / 2
    octave: Flags = used & (spectrum.frequency > corner)
    return octave if corner >= FILTERED_HZ else np.zeros_like(used)


def _excess_above(spectrum: CosineSpectrum, powers: Powers, below: Powers) -> float:
    """Excess of bins over what those `below` predict, in standard errors."""
    above = below.free & ~powers.free
    found = fit_untimed_terms(spectrum, below)
    power, count = (a[above].sum(axis=1) for a in (powers.power, powers.count))
    slopes = expected_powers(spectrum, found.terms, found.x)[1][above]
    slope = count @ slopes / count.sum()
    variance = 2 / count.sum() + slope @ found.covariance @ slope
    ratio = float(np.sum(power / found.level[above]) / count.sum())
    return float((ratio - 1) / np.sqrt(variance * _dispersion(below, found)))


def _without_lines(spectrum: CosineSpectrum, powers: Powers, rich: NoiseFit) -> Powers:
    """Leave bins above 1 Hz with lines out of the fit."""
    excess = _excess(powers, rich)
    usual = MAD_TO_SIGMA * np.median(np.abs(excess[~powers.free]))
    odd = (excess > 6 * max(1.0, usual)) & (spectrum.frequency > FILTERED_HZ)
    return replace(powers, free=powers.free | odd)


def fit_untimed_terms(spectrum: CosineSpectrum, powers: Powers) -> NoiseFit:
    """Fit all processes without a correlation time, less those that vanish."""
    used = ~powers.free
    terms = list(UNTIMED_TERMS)
    columns = np.array([spectrum.column(term) for term in UNTIMED_TERMS])[:, used]
    sizes = _multiplicative_sizes(columns, powers.power[used].sum(axis=1),
                                  powers.count[used].sum(axis=1))  # fmt: skip
    while len(terms) > 1:
        if found := fit_processes(spectrum, powers, tuple(terms), np.log(sizes)):
            return found
        # remove the process with the least part in any bin
        parts = (sizes[:, None] * columns / (sizes @ columns)).max(axis=1)
        gone = 1 + int(np.argmin(parts[1:]))
        terms.pop(gone)
        sizes, columns = np.delete(sizes, gone), np.delete(columns, gone, axis=0)
    return _white_only(spectrum, powers)


def _multiplicative_sizes(columns: Array, power: Array, count: Array) -> Array:
    """Variances (p,) near their most likely ones, by multiplication.

    Each step raises the likelihood (Fevotte and Idier 2011, Itakura-Saito).
    """
    sizes: Array = (power.sum() / count.sum()) / (columns.max(axis=1) * len(columns))
    for _ in range(MULTIPLIED):
        level = sizes @ columns
        sizes *= np.sqrt(columns @ (power / level**2) / (columns @ (count / level)))
    least: Array = np.maximum(sizes, 1e-12 * sizes.max())
    return least


def _excess(powers: Powers, found: NoiseFit) -> Array:
    """Excess of each bin over the model, in standard errors, (b,)."""
    count = powers.count.sum(axis=1)
    ratio = powers.power.sum(axis=1) / np.maximum(count, 1e-300) / found.level
    excess: Array = np.where(count > 0, (ratio - 1) * np.sqrt(count / 2), 0.0)
    return excess


def _dispersion(powers: Powers, found: NoiseFit) -> float:
    """Mean squared excess of the bins that the model explains, at least 1."""
    some: Flags = ~powers.free & (powers.count.sum(axis=1) > 1)
    freedom = int(some.sum()) - len(found.x)
    if freedom < 1:
        return 1.0
    squares = float(np.sum(_excess(powers, found)[some] ** 2)) / freedom
    # exceeded by chance in one of forty
    return squares if squares > 1 + 2 * np.sqrt(2 / freedom) else 1.0
