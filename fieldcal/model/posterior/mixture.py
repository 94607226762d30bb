"""The estimate of a set, averaged over sizes and over windows that may be bad.

The instability of the biases is known only from the scatter of a few windows, and any
window may be disturbed without showing it. Values of the instability and bad windows
are hypotheses h, each with its evidence (`model.evidence`). The estimate is their
mixture,

    mean = sum_h P(h) mean_h,    cov = sum_h P(h) [cov_h + off_h off_h^T],
    off_h = mean_h - mean

With few degrees of freedom the intervals are thus as wide as those of Student's t. They
are also wider if a window may be bad; a window that is certainly bad has no weight.

Source: Bayesian model averaging; for windows, Cook and Weisberg 1982, 2.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.unknown_causes import typical_unknown_sizes
from fieldcal.model.evidence.eliminated import evidence_gains
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.levels import InstabilityScan, scan_instabilities
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import (
    INSTABILITY_LOG_DENSITY,
    LOG_DENSITY,
    TRIADS,
    Sizing,
    instability_log_prior,
)

GIVEN_SET_LOG_DENSITY = np.log(priors.instability_density_of_given_set())
"""Log prior of instabilities if no causes were searched for: then causes that are not
in the set may add to the scatter of windows."""

NONE: Index = np.empty((0, 1), dtype=np.intp)
"""No columns."""


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """Hypothesis: instabilities of the channels, and possibly a bad window.

    Attributes
    ----------
    sizes : (7,) indices in `priors.SIZES`
    window : number of the bad window, -1 for none
    size : index of the size of its error
    log_prior : log prior probability
    score : ln of evidence times prior probability

    """

    sizes: tuple[int, ...]
    window: int
    size: int
    log_prior: float
    score: float


Hypotheses = tuple[Hypothesis, ...]
"""One hypothesis for each triad."""


@dataclass(frozen=True, slots=True)
class Mixture:
    """The estimate, averaged over hypotheses.

    Attributes
    ----------
    columns : (k,) of the dictionary
    mean, covariance : (k,), (k, k)
    prior_sigma : (k,) standard deviation of each before the rows are seen
    bad : (p,) probability that a window is bad
    scatter : (7,) rms instability of each channel from window to window, and of
        closures, units of the output and rad
    score : ln of the evidence of the set

    """

    columns: Index
    mean: Array
    covariance: Array
    prior_sigma: Array
    bad: Array
    scatter: Array
    score: float


class Mixing:
    """Averages the estimate of a set over hypotheses.

    Parameters
    ----------
    dictionary, gram : columns, and their Gram matrix about the set's own state
    fitted : the set at its most probable sizes
    typical_instability : (7,) typical instability, 0 where there is none
    given : whether the set is given and not found by a search: then windows may be bad,
        or be scattered by unknown causes
    doubt : whether windows may be bad; False if an earlier run found none

    """

    def __init__(
        self,
        dictionary: Dictionary,
        gram: Gram,
        fitted: Set,
        typical_instability: Array,
        given: bool = True,
        doubt: bool = True,
    ) -> None:
        self.dictionary = dictionary
        self.fitted = fitted
        self.typical_instability = typical_instability
        self.density = GIVEN_SET_LOG_DENSITY if given else INSTABILITY_LOG_DENSITY
        sizing = Sizing(
            dictionary, gram, typical_instability, fitted.members, fitted.sizes
        )
        self.columns, self.prior_sigma = sizing.columns, fitted.state.prior_sigma
        self.doubted = self._offsets_of_windows() if given and doubt else NONE
        wanted = np.append(self.columns, self.doubted)
        self.gram = gram.select_columns(wanted)
        self.bad = np.zeros(len(dictionary.window_positions))

    def run(self) -> Mixture:
        """Average over all hypotheses that count."""
        lists = [self._triad_hypotheses(triad) for triad in TRIADS]
        best = sum(max(h.score for h in hypotheses) for hypotheses in lists)
        least = best - thresholds.AVERAGED_LOG_DISTANCE
        near = [p for p in product(*lists) if sum(h.score for h in p) > least]
        sizes = priors.SIZES[[self._sizes_of(parts) for parts in near]]
        tau = sizes * self.typical_instability
        score, means, covariances = self._combine_exactly(near, tau)
        score += instability_log_prior(
            self.fitted.sizes.instability, self.typical_instability, self.density
        )
        total = float(np.logaddexp.reduce(score))
        weight = np.exp(score - total)
        mean: Array = weight @ means
        covariance = np.einsum("h,hij->ij", weight, covariances)
        covariance += covariance_of_means(means, weight)
        scatter = np.sqrt(weight @ tau**2)
        return Mixture(
            self.columns, mean, covariance, self.prior_sigma, self.bad, scatter, total
        )

    def _offsets_of_windows(self) -> Index:
        """Columns of the accelerometers' offsets in each window, (w, k).

        Empty for two windows or fewer, which could only contradict each other.
        """
        d = self.dictionary
        observed = [d.window_columns(c) for c in d.observed.tolist() if c < 3]
        if len(d.window_positions) <= 2 or not observed:
            return NONE
        return np.column_stack(observed)

    def _triad_hypotheses(self, triad: Sequence[int]) -> list[Hypothesis]:
        """Hypotheses about one triad that count, the other triads fixed."""
        mode = self.fitted.sizes.instability
        first = Hypothesis(mode, -1, 0, 0.0, 0.0)
        if not self.typical_instability[list(triad)].any():
            return [first]
        sizes, log_priors = self._shifted(triad)
        doubted = self.doubted if triad[0] == 0 else NONE
        taus = priors.SIZES[np.array(sizes)] * self.typical_instability
        scan = scan_instabilities(
            self.gram, self.columns, self.prior_sigma, taus, doubted
        )
        without_bad = scan.score + log_priors
        hypotheses = [
            Hypothesis(s, -1, 0, k, v)
            for s, k, v in zip(
                sizes, log_priors.tolist(), without_bad.tolist(), strict=True
            )
        ]
        if len(doubted):
            log_prior = (
                log_priors[:, None]
                + float(np.log(priors.BAD_WINDOW_CHANCE))
                + LOG_DENSITY
            )  # (n, v)
            with_bad = (
                self._bad_window_gains(scan)
                + scan.score[:, None, None]
                + log_prior[:, None]
            )  # (n, w, v)
            by_window = np.logaddexp.reduce(with_bad, axis=(0, 2))
            total = np.logaddexp.reduce([*without_bad, *by_window])
            self.bad = np.exp(by_window - total)
            near = np.argwhere(
                with_bad > without_bad.max() - thresholds.AVERAGED_LOG_DISTANCE
            )
            for n, i, v in near.tolist():
                prior, score = float(log_prior[n, v]), float(with_bad[n, i, v])
                hypotheses.append(Hypothesis(sizes[n], i, v, prior, score))
        best = max(h.score for h in hypotheses)
        return [
            h for h in hypotheses if h.score > best - thresholds.AVERAGED_LOG_DISTANCE
        ]

    def _shifted(self, triad: Sequence[int]) -> tuple[list[tuple[int, ...]], Array]:
        """Instabilities of a triad, all scaled together, with their log priors.

        Log priors are relative to the most probable instability. Those too small to be
        distinguished are combined into one.
        """
        mode = self.fitted.sizes.instability
        middle = round(float(np.mean([mode[c] for c in triad])))
        top = len(priors.SIZES) - 1
        moved = [
            tuple(min(max(m + s, 0), top) if c in triad else m
                  for c, m in enumerate(mode))
            for s in range(-middle, top + 1 - middle)
        ]  # fmt: skip
        log_prior: Array = instability_log_prior(
            np.array(moved), self.typical_instability, self.density
        )
        log_prior -= instability_log_prior(mode, self.typical_instability, self.density)
        first = max(0, self._smallest_visible_index(triad) - 1)
        log_prior[first] = np.logaddexp.reduce(log_prior[: first + 1])
        return moved[first:], log_prior[first:]

    def _smallest_visible_index(self, triad: Sequence[int]) -> int:
        """Index of the smallest of `SIZES` at which a triad's instability shows."""
        measured = np.isin(self.gram.kind, triad) & (self.gram.info > 0)
        noise = 1 / np.sqrt(self.gram.info[measured].max(initial=1e-300))
        typical = float(self.typical_instability[list(triad)].max())
        return int(
            np.searchsorted(priors.SIZES * typical, thresholds.MIN_INSTABILITY * noise)
        )

    def _bad_window_gains(self, scan: InstabilityScan) -> Array:
        """Gains if a window is bad, by instability, window and size, (n, w, v)."""
        typical = self._typical_offset
        inner = scan.inner * typical * typical[:, None]
        own = (scan.diagonal * typical**2).max(axis=-1)
        return evidence_gains(inner, scan.rhs * typical, own)

    def _sizes_of(self, parts: Hypotheses) -> list[int]:
        """Instabilities of hypotheses of each triad together, (7,)."""
        sizes = list(self.fitted.sizes.instability)
        for triad, hypothesis in zip(TRIADS, parts, strict=True):
            for c in triad:
                sizes[c] = hypothesis.sizes[c]
        return sizes

    def _combine_exactly(
        self, near: Sequence[Hypotheses], tau: Array
    ) -> tuple[Array, Array, Array]:
        """Scores (h,), means (h, k), covariances (h, k, k) of combined hypotheses.

        `near` are those of each triad, `tau` (h, 7) their instabilities.
        """
        k = len(self.columns)
        score = np.array([sum(h.log_prior for h in parts) for parts in near])
        mean, covariance = np.empty((len(near), k)), np.empty((len(near), k, k))
        window = np.array([acc.window for acc, *_ in near])
        for bad in np.unique(window).tolist():
            rows = np.flatnonzero(window == bad)
            columns = self.columns
            prior_sigma = np.tile(self.prior_sigma, (len(rows), 1))
            if bad >= 0:
                off = priors.SIZES[[near[h][0].size for h in rows.tolist()]]
                columns = np.append(columns, self.doubted[bad])
                offset = np.outer(off, self._typical_offset)
                prior_sigma = np.hstack([prior_sigma, offset])
            scan = scan_instabilities(self.gram, columns, prior_sigma, tau[rows], NONE)
            score[rows] += scan.score
            means, covariances = scan.posterior()
            mean[rows], covariance[rows] = means[:, :k], covariances[:, :k, :k]
        return score, mean, covariance

    @property
    def _typical_offset(self) -> Array:
        """Typical offset of each accelerometer in a bad window, (k,), outputs."""
        d = self.dictionary
        return typical_unknown_sizes(d)[[c for c in d.observed if c < 3]]


def covariance_of_means(means: Array, weight: Array) -> Array:
    """Covariance (k, k) of the means (n, k) of hypotheses of some weights, sum 1.

    It is added to the mean of their covariances (law of total covariance).
    """
    off = means - weight @ means
    return (weight[:, None] * off).T @ off
