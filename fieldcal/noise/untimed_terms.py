"""Processes without a correlation time, fitted together."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import NoiseFit, Powers, fit_processes
from fieldcal.noise.spectrum import CosineSpectrum

UNTIMED_TERMS = ("N", "Q", "B", "K")
"""White noise, quantisation, bias instability, random walk."""

MULTIPLIED = 100
"""Steps towards the most likely sizes."""


def fit_white_noise(spectrum: CosineSpectrum, powers: Powers) -> NoiseFit:
    """Fit white noise alone."""
    used = ~powers.free
    column = spectrum.fixed_columns["N"][used]
    total = (powers.power[used].sum(axis=1) / column).sum() / powers.count[used].sum()
    found = fit_processes(spectrum, powers, ("N",), np.log([total]))
    if found is None:
        raise AssertionError("white noise is in every bin")
    return found


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
    return fit_white_noise(spectrum, powers)


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
