"""Bins that show a filter of the device, or lines: they are left out of the fit.

Above 1 Hz, where a device filters its outputs and machines hum, bins can have a level
of their own instead: the noise of windows of seconds is below.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.noise.fit_quality import (
    dispersion_of_bins,
    excess_of_bins,
    predicts_better,
)
from fieldcal.noise.likelihood import Flags, NoiseFit, Powers, expected_powers
from fieldcal.noise.spectrum import CosineSpectrum
from fieldcal.noise.untimed_terms import fit_untimed_terms

FILTERED_HZ = 1.0
"""Lowest corner frequency of a device's filter, Hz."""

BENT = 2.5
"""Standard errors by which an octave is off that a filter bends."""

MIN_LEFT = 500
"""Fewest coefficients that are left: they tell white noise to 3 %."""

FOLDED = 0.02
"""Largest part of its white noise that a bin may have from beyond a corner."""


def without_filter(spectrum: CosineSpectrum, powers: Powers) -> Powers:
    """Leave bins above a corner out of the fit, if that predicts better."""
    top = spectrum.frequency.max()
    best, chosen = fit_untimed_terms(spectrum, powers), powers
    corner = top / 2
    while corner >= FILTERED_HZ:
        free = powers.free | (spectrum.frequency > corner)
        tried = replace(powers, free=free)
        found = fit_untimed_terms(spectrum, tried)
        if predicts_better(found, best):
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
    return float((ratio - 1) / np.sqrt(variance * dispersion_of_bins(below, found)))


def _without_lines(spectrum: CosineSpectrum, powers: Powers, rich: NoiseFit) -> Powers:
    """Leave bins above 1 Hz with lines out of the fit."""
    excess = excess_of_bins(powers, rich)
    usual = MAD_TO_SIGMA * np.median(np.abs(excess[~powers.free]))
    odd = (excess > 6 * max(1.0, usual)) & (spectrum.frequency > FILTERED_HZ)
    return replace(powers, free=powers.free | odd)
