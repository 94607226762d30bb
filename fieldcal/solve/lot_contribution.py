"""Prior of a unit from its production lot, unless the unit is an outlier.

The lot's mean and covariance are rows of the model (`averaging.lot_rows`), so that
estimate, tilt and bad windows are found with them. A unit may differ from its lot, (1)
of `calibration.lot_prior`. With x, C the estimate and covariance of the unit alone, m
the lot's mean, and P_h the covariance of the units under hypothesis h,

    C_h = (C^-1 + P_h^-1)^-1,    x_h = m + C_h C^-1 (x - m)                        (1)
    ln Z_h = [(x_h - m)^T C_h^-1 (x_h - m) + ln |C_h| - ln |P_h|] / 2 + const       (2)

and the result is the mixture of the hypotheses. If a unit is more likely an outlier
than not, the lot is not used. Source: Box and Tiao, Biometrika 55 (1968) 119.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.calibration.gauge import GROUPS
from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.calibration.names import group_of
from fieldcal.calibration.wording import format_unit, format_with_sigma
from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.posterior.mixture import covariance_of_means
from fieldcal.solve.estimation import ParameterEstimate

ALL_PARAMETERS = ""
"""In place of a parameter's name: all parameters, not a single one."""


@dataclass(frozen=True, slots=True)
class LotContribution:
    """Contribution of the production lot to the result of a unit.

    Attributes
    ----------
    lot : prior of the parameters that unit and lot have in common
    outlier_probability : probability that the unit is an outlier
    outlier_parameter : parameter in which it most likely is one; empty for all
    own : value and standard uncertainty by full name, without the lot
    combined : the same with the lot

    """

    lot: LotPrior
    outlier_probability: float
    outlier_parameter: str
    own: Mapping[str, tuple[float, float]]
    combined: Mapping[str, tuple[float, float]]

    @property
    def refused(self) -> bool:
        """Whether the unit is an outlier, so that the lot is not used."""
        return self.outlier_probability > thresholds.NAMED

    @property
    def sentence(self) -> str:
        """What the lot contributes, or why it is not used."""
        units = f"{min(self.lot.units)} units of {self.lot.label}"
        if self.refused:
            return (
                f"this unit is odd beside {units} (P = {self.outlier_probability:.2f}):"
                f" {self._largest_shift()}; nothing of the lot is in the result:"
                " see whether it is the right lot, and examine the unit"
            )
        name = min(self.lot.names, key=self._remaining_share)
        unit = _unit(name)
        before = self.own.get(name)
        instead = f"± {before[1]:.2g}" if before else "none"
        perhaps = ""
        if self.outlier_probability > thresholds.MENTIONED:
            perhaps = (
                f"; the unit may be odd, P = {self.outlier_probability:.2f}:"
                f" {self._largest_shift()},"
                " which is in the uncertainties"
            )
        return (
            f"what {units} say is in this result: {name} has"
            f" {instead} by itself and"
            f" {f'± {self.combined[name][1]:.2g} {unit}'.strip()} with it{perhaps}"
        )

    def _remaining_share(self, name: str) -> float:
        """Uncertainty of a parameter with the lot, as a part of that without."""
        return self.combined[name][1] / self.own.get(name, (0.0, np.inf))[1]

    def _largest_shift(self) -> str:
        """Sentence part: the largest difference of the unit from its lot."""
        rows = zip(self.lot.names, self.lot.mean, self.lot.sigma, strict=True)
        off = {
            n: (self.own[n][0] - m) / np.hypot(self.own[n][1], s)
            for n, m, s in rows
            if n in self.own
        }
        name = self.outlier_parameter or max(off, key=lambda n: abs(off[n]), default="")
        if name not in off:
            return "in what several parameters are together"
        i = self.lot.names.index(name)
        own = " ± ".join(format_with_sigma(*self.own[name]))
        usual = " ± ".join(
            format_with_sigma(float(self.lot.mean[i]), float(self.lot.sigma[i]))
        )
        unit = f" {_unit(name)}".rstrip()
        return f"{name} is {own}{unit}, where the lot has {usual}"

    def to_json(self) -> dict[str, Any]:
        """Return the object of result.json."""
        rows = zip(
            self.lot.names, self.lot.mean.tolist(), self.lot.sigma.tolist(),
            self.lot.units, strict=True,
        )  # fmt: skip
        return {
            "lot": self.lot.label,
            "odd_probability": self.outlier_probability,
            "odd_parameter": (self.outlier_parameter or None) if self.refused else None,
            "refused": self.refused,
            "parameters": {
                name: {
                    "units": units,
                    "lot_value": mean,
                    "lot_sigma": sigma,
                    "own_value": self.own.get(name, (None, None))[0],
                    "own_sigma": self.own.get(name, (None, None))[1],
                    "sigma": self.combined[name][1],
                }
                for name, mean, sigma, units in rows
            },
        }


def _unit(name: str) -> str:
    return format_unit(GROUPS[group_of(name)][2])


def combine_with_lot(
    own: ParameterEstimate, with_lot: ParameterEstimate, lot: LotPrior
) -> tuple[ParameterEstimate, LotContribution | None]:
    """The estimate with the lot, or without it if the unit is an outlier.

    `own` is the estimate without the lot. The contribution is None if unit and lot have
    no parameter in common.
    """
    lot = lot.subset([n for n in with_lot.names if n in own.parameter_set.names])
    if not lot.names:
        return own, None
    others = _OutlierHypotheses.of(own, lot)
    odd = others.outlier_probability > thresholds.NAMED
    kept = own if odd else others.mixture_with(with_lot)
    lot = lot.subset(kept.names)
    contribution = LotContribution(
        lot, others.outlier_probability, others.outlier_parameter, _estimates(own),
        _estimates(kept),
    )  # fmt: skip
    return kept, contribution


def _estimates(estimate: ParameterEstimate) -> dict[str, tuple[float, float]]:
    """Value and sigma of each parameter by its full name."""
    pairs = zip(estimate.values.tolist(), estimate.sigma.tolist(), strict=True)
    return dict(zip(estimate.names, pairs, strict=True))


@dataclass(frozen=True, slots=True)
class _OutlierHypotheses:
    """Hypotheses of an outlier; the first one is that the unit is none.

    Attributes
    ----------
    names : (k,) all parameters of the unit's own set
    parameters : (h,) parameter of the outlier; empty if it is not a single one
    probabilities : (h,)
    means, covariances : (h, k), (h, k, k), (1)

    """

    names: tuple[str, ...]
    parameters: tuple[str, ...]
    probabilities: Array
    means: Array
    covariances: Array

    @classmethod
    def of(cls, own: ParameterEstimate, lot: LotPrior) -> _OutlierHypotheses:
        """Weigh the hypotheses by the estimate without the lot, (1) and (2)."""
        names, every = own.parameter_set.names, own.all_parameters
        at = np.array([names.index(name) for name in lot.names])
        scale = np.sqrt(np.diag(every.covariance))
        information = np.linalg.inv(every.covariance / scale / scale[:, None])
        middle = np.zeros(len(names))
        middle[at] = lot.mean / scale[at]
        rhs = information @ (every.values / scale - middle)
        wide = lot.covariance / scale[at] / scale[at][:, None]
        odd, chances, spreads = zip(*_hypothesis_priors(lot, wide), strict=True)
        covariances, score = [], np.log(chances)
        for i, spread in enumerate(spreads):
            information_with_lot = information.copy()
            information_with_lot[np.ix_(at, at)] += np.linalg.inv(spread)
            covariances.append(np.linalg.inv(information_with_lot))
            score[i] += 0.5 * float(rhs @ covariances[i] @ rhs)  # (2)
            score[i] -= 0.5 * float(np.linalg.slogdet(information_with_lot)[1])
            score[i] -= 0.5 * float(np.linalg.slogdet(spread)[1])
        made = np.array(covariances)
        return cls(
            names, odd, np.exp(score - np.logaddexp.reduce(score)),
            (middle + made @ rhs) * scale,  # (1)
            made * scale * scale[:, None],
        )  # fmt: skip

    @property
    def outlier_probability(self) -> float:
        """Probability that the unit is an outlier."""
        return float(self.probabilities[1:].sum())

    @property
    def outlier_parameter(self) -> str:
        """Most likely parameter of an outlier; empty for all."""
        return self.parameters[1 + int(np.argmax(self.probabilities[1:]))]

    def mixture_with(self, estimate: ParameterEstimate) -> ParameterEstimate:
        """Mixture of the estimate with the lot and those of the outlier hypotheses."""
        ours = [i for i, name in enumerate(estimate.names) if name in self.names]
        at = [self.names.index(estimate.names[i]) for i in ours]
        means = np.tile(estimate.values, (len(self.probabilities), 1))
        covariances = np.tile(estimate.covariance, (len(self.probabilities), 1, 1))
        means[1:, ours] = self.means[1:, at]
        both = np.ix_(range(1, len(self.probabilities)), ours, ours)
        covariances[both] = self.covariances[1:][:, at][:, :, at]
        mean = self.probabilities @ means
        covariance = np.einsum("h,hij->ij", self.probabilities, covariances)
        covariance += covariance_of_means(means, self.probabilities)
        return replace(estimate, values=mean, covariance=covariance)


def _hypothesis_priors(
    lot: LotPrior, wide: Array
) -> Iterator[tuple[str, float, Array]]:
    """Parameter, prior odds and P_h of each hypothesis."""
    yield ALL_PARAMETERS, 1.0, wide
    more = lot.outlier_factor**2 - 1
    for j, name in enumerate(lot.names):
        spread = wide.copy()
        spread[j, j] += more * wide[j, j]
        odd = float(lot.outlier_probability[j])
        yield name, odd / (1 - odd), spread
    odd = float(lot.outlier_probability.mean())
    yield ALL_PARAMETERS, odd / (1 - odd), (1 + more) * wide
