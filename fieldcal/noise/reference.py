"""The most probable sizes of processes, with the reference prior.

    log p = log L + log |J| / 2                                                    (1)

J is the information about the logarithms of the sizes, L and J as in `likelihood`. If a
process is known to a third of its size, its most likely size is near zero in a few of a
hundred recordings, and too small on average, because the likelihood stays high at zero.
J vanishes for a process that adds nothing, so (1) is low there. If a size is well
known, J hardly depends on it, and (1) has its maximum where L has. The prior is the
same for a deviation, a variance and its logarithm. Correlation times stay the most
likely ones: the time of a negligible process is unknown, and J would be largest at a
time that makes it known. Sources:
Jeffreys 1946; Firth 1993, whose correction of the bias of first order this maximum is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import (
    CLOSE,
    LONGEST_STEP,
    MOST_STEPS,
    NoiseFit,
    Powers,
    expected_powers,
    information_matrix,
)
from fieldcal.noise.spectrum import CosineSpectrum

LOG_STEP = 1e-3
"""Step of the logarithms for the numerical slope of (1)."""

MIN_STEP_SHARE = 2.0**-12
"""Least part of a step that is tried."""


@dataclass(frozen=True, slots=True)
class SizeDensity:
    """Log density (1) of the sizes, at given correlation times.

    Attributes
    ----------
    columns : (b, p) expected powers of each process of unit variance
    power, count : (b,) sums of squares, and of how many

    """

    columns: Array
    power: Array
    count: Array

    @classmethod
    def of(
        cls, spectrum: CosineSpectrum, powers: Powers, terms: tuple[str, ...], x: Array
    ) -> SizeDensity:
        """The density for processes with the times in x, log of variances and times."""
        used = ~powers.free
        level, slopes = expected_powers(spectrum, terms, x)
        sizes = slice(0, len(terms))
        columns = slopes[used, sizes] * level[used, None] * np.exp(-x[sizes])
        power, count = (a[used].sum(axis=1) for a in (powers.power, powers.count))
        return cls(columns, power, count)

    def information(self, x: Array) -> Array:
        """J (d, p, p) at logarithms of variances (d, p)."""
        parts = np.exp(x)[:, None, :] * self.columns
        shares = parts / parts.sum(axis=2, keepdims=True)
        turned = (self.count[:, None] * shares).transpose(0, 2, 1)
        return np.asarray(0.5 * turned @ shares)

    def log_density(self, x: Array) -> Array:
        """Log density (d,) at logarithms of variances (d, p), but for a constant."""
        level = np.exp(x) @ self.columns.T
        likely = np.log(level) @ self.count + (self.power / level).sum(axis=1)
        volume = np.linalg.slogdet(self.information(x))[1]
        return np.asarray((volume - likely) / 2)  # (1)


def most_probable_sizes(
    spectrum: CosineSpectrum, powers: Powers, found: NoiseFit
) -> NoiseFit:
    """The sizes where (1) is highest, from the most likely ones.

    Likelihood and scores stay those of the most likely sizes: sets of processes are
    compared by these.
    """
    density = SizeDensity.of(spectrum, powers, found.terms, found.x)
    sizes = _maximise(density, found.x[: len(found.terms)])
    x = np.concatenate([sizes, found.x[len(found.terms) :]])
    level, slopes = expected_powers(spectrum, found.terms, x)
    return replace(
        found, x=x, level=level, information=information_matrix(powers, slopes)
    )


def _maximise(density: SizeDensity, x: Array) -> Array:
    """Logarithms of variances (p,) where (1) is highest, near some."""
    best = float(density.log_density(x[None])[0])
    for _ in range(MOST_STEPS):
        step, part = _step(density, x), 1.0
        while part >= MIN_STEP_SHARE:
            higher = float(density.log_density((x + part * step)[None])[0])
            if higher > best:
                break
            part /= 2
        else:
            return x
        x, best = x + part * step, higher
        if float(np.max(np.abs(part * step))) < CLOSE:
            return x
    return x


def _step(density: SizeDensity, x: Array) -> Array:
    """J^-1 times the slope of (1), (p,)."""
    aside = LOG_STEP * np.eye(len(x))
    slope = (density.log_density(x + aside) - density.log_density(x - aside)) / (
        2 * LOG_STEP
    )
    step = np.linalg.pinv(density.information(x[None])[0], hermitian=True) @ slope
    out: Array = step * min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-300))
    return out
