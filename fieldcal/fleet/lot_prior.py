"""Prior of a lot's next unit, from the results of its other units (hierarchical model).

A unit's parameters theta_i follow the distribution of its lot; its result x_i has the
covariance C_i of its own rows:

    theta_i ~ N(mu, S),   x_i ~ N(theta_i, C_i)                                    (1)

A Gibbs sampler draws mu and S. The prior of S is that of Huang and Wand, in which all
correlations are equally probable and spreads have any size. In units of s,

    mu | S ~ N(G^-1 sum_i (S + C_i)^-1 x_i, G^-1),   G = sum_i (S + C_i)^-1        (2)
    theta_i | rest ~ N(V_i (S^-1 mu + C_i^-1 x_i), V_i),  V_i = (S^-1 + C_i^-1)^-1 (3)
    1 / a_j | rest ~ Gamma((f + k) / 2, rate f (S^-1)_jj + 1 / A^2)                (4)
    S | rest ~ IW(f + n + k - 1, sum_i (theta_i - mu)(theta_i - mu)^T + 2 f / a)   (5)

The next unit has mean <mu> and covariance <S> + cov mu; the second term is the
uncertainty that few units leave. Units that are odd in a parameter (`spread`) are left
out. Source: Gelman and others, Bayesian Data Analysis, 5 and 15; Huang and Wand,
Bayesian Analysis 8 (2013) 439.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.gauge import GROUPS
from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.calibration.names import group_of
from fieldcal.core.errors import InputError
from fieldcal.core.recorded_part import RecordedPart
from fieldcal.core.samples import Array
from fieldcal.fleet.lot import MIN_UNITS
from fieldcal.fleet.spread import WIDER, UnitDistribution, estimate_distribution
from fieldcal.fleet.units import latest_session_per_unit
from fieldcal.history.sessions import StoredSession, parameter_values

KEPT_DRAWS, DROPPED_DRAWS = 2000, 200
"""Number of draws that are used, and of draws before them that are dropped."""

MAX_UNITS = 150
"""Largest number of units that the sampler uses; they give a spread to 6 %."""

SHAPE = 2.0
"""f: correlations are equally likely."""

SPREAD_FACTOR = 10.0
"""A: factor by which spreads may exceed their first estimate."""

BY_GRAVITY = "acc_scale"
"""Group that is measured against gravity: an error of gravity is common to a site."""


def estimate_lot_prior(
    label: str,
    sessions: Sequence[StoredSession],
    serial: str = "",
    folder: str = "",
    part: RecordedPart | None = None,
) -> LotPrior:
    """Estimate the prior of a unit from the other units of its lot.

    Parameters
    ----------
    label : name of the lot in messages and results
    sessions : sessions of the lot, with their documents
    serial, folder, part : of the unit, its session and the samples that it uses, which
        are left out

    Raises
    ------
    InputError
        If fewer than `MIN_UNITS` other units know any parameter.

    """
    others = [
        one for one in sessions
        if one.folder != folder and not (serial and one.serial == serial)
        and not (part and one.part and one.part.overlaps(part))
    ]  # fmt: skip
    units = [one for one in latest_session_per_unit(others) if one.good]
    found: dict[str, UnitDistribution] = {}
    for name in dict.fromkeys(n for one in units for n in one.parameters):
        x, sigma = parameter_values(
            [one for one in units if _is_informative(one, name)], name
        )
        known = np.isfinite(x) & (sigma > 0)
        if known.sum() >= MIN_UNITS and group_of(name) in GROUPS:
            found[name] = estimate_distribution(x[known], sigma[known])
    if not found:
        raise InputError(
            f"{label}: {len(units)} other units have a good result, a lot needs"
            f" {MIN_UNITS}: run fieldcal batch on more sessions, ask for fewer"
            " conditions, or leave --lot out"
        )
    names, about = tuple(found), list(found.values())
    mean, covariance = np.zeros(len(names)), np.zeros((len(names),) * 2)
    for sensor in (0, 1):
        at = [i for i, n in enumerate(names) if GROUPS[group_of(n)][0] == sensor]
        if at:
            some = [names[i] for i in at]
            told = _UnitInformation.of(units, some, [about[i] for i in at])
            mean[at], covariance[np.ix_(at, at)] = told.predict_next_unit()
    return LotPrior(
        label,
        names,
        mean,
        covariance,
        np.array([one.odd_fraction for one in about]),
        WIDER,
        tuple(len(one.typical_probability) for one in about),
    )


def _is_informative(one: StoredSession, name: str) -> bool:
    """Whether a unit's value of a parameter is used for the lot.

    A scale factor is used only if gravity was known, from latitude and height.
    """
    if group_of(name) != BY_GRAVITY:
        return True
    result: Mapping[str, Any] = one.result or {}
    latitude = result.get("conditions", {}).get("latitude_deg")
    return latitude is not None and "height_m" in result.get("site", {})


@dataclass(frozen=True, slots=True)
class _UnitInformation:
    """Results of the units for some parameters, as information matrices.

    Attributes
    ----------
    centre, scale : (k,) in which everything here is: parameter = middle + size z
    information, rhs : (n, k, k), (n, k) C^-1 and C^-1 x of each unit

    """

    centre: Array
    scale: Array
    information: Array
    rhs: Array

    @classmethod
    def of(
        cls,
        units: Sequence[StoredSession],
        names: Sequence[str],
        about: Sequence[UnitDistribution],
    ) -> _UnitInformation:
        """Collect the units that are not odd."""
        middle = np.array([one.mean for one in about])
        size = np.sqrt([one.mean_square_spread + one.mean_sigma**2 for one in about])
        k = len(names)
        every, pulls = [], []
        for one in units:
            at, x, covariance = _unit_values(one, names)
            scaled = covariance / size[at] / size[at][:, None]
            z = (x - middle[at]) / size[at]
            usual = np.abs(z) / np.sqrt(1 + np.diag(scaled))
            if not at or usual.max() > WIDER / 2:
                continue
            told, rhs = np.zeros((k, k)), np.zeros(k)
            told[np.ix_(at, at)] = np.linalg.inv(scaled)
            rhs[at] = told[np.ix_(at, at)] @ z
            every.append(told)
            pulls.append(rhs)
        some = (
            np.linspace(0, len(every) - 1, min(len(every), MAX_UNITS))
            .round()
            .astype(int)
        )
        return cls(middle, size, np.array(every)[some], np.array(pulls)[some])

    def predict_next_unit(self) -> tuple[Array, Array]:
        """Return mean (k,) and covariance (k, k) of the next unit."""
        rng = np.random.default_rng(1)
        n, k = self.rhs.shape
        spread_: Array = np.eye(k)
        means, spreads = [], []
        for draw in range(DROPPED_DRAWS + KEPT_DRAWS):
            inverse = np.linalg.inv(spread_)
            root = np.linalg.cholesky(inverse + self.information)
            half = np.linalg.solve(root, self.information)
            both = np.linalg.inv(
                (self.information - half.transpose(0, 2, 1) @ half).sum(0)
            )
            seen = np.linalg.solve(root, self.rhs[..., None])
            rhs = (self.rhs - (half.transpose(0, 2, 1) @ seen)[..., 0]).sum(axis=0)
            # `both` is the inverse of a sum of information: nothing to be checked
            mu = rng.multivariate_normal(both @ rhs, both, check_valid="ignore")  # (2)
            white = np.linalg.solve(root, (self.rhs + inverse @ mu)[..., None])
            white += rng.standard_normal((n, k, 1))
            theta = np.linalg.solve(root.transpose(0, 2, 1), white)[..., 0]  # (3)
            rate = SHAPE * np.diag(inverse) + SPREAD_FACTOR**-2
            over = rng.gamma((SHAPE + k) / 2, 1 / rate)  # (4)
            off = theta - mu
            whole = off.T @ off + 2 * SHAPE * np.diag(over)
            spread_ = _inverse_wishart(rng, SHAPE + n + k - 1, whole)  # (5)
            if draw >= DROPPED_DRAWS:
                means.append(mu)
                spreads.append(spread_)
        covariance = np.mean(spreads, axis=0) + np.cov(np.array(means).T)
        mean: Array = np.mean(means, axis=0)
        return (
            self.centre + self.scale * mean,
            covariance * self.scale * self.scale[:, None],
        )


def _inverse_wishart(rng: np.random.Generator, dof: float, scale: Array) -> Array:
    """Draw a matrix (k, k) from the inverse Wishart distribution (Bartlett)."""
    k = len(scale)
    lower = np.tril(rng.standard_normal((k, k)), -1)
    lower += np.diag(np.sqrt(rng.chisquare(dof - np.arange(k))))
    root = np.linalg.solve(lower, np.linalg.cholesky(scale).T)
    out: Array = root.T @ root
    return out


def _unit_values(
    one: StoredSession, names: Sequence[str]
) -> tuple[list[int], Array, Array]:
    """Return which parameters a unit has measured, their values and covariance."""
    at = [i for i, name in enumerate(names)
          if name in one.parameters and _is_informative(one, name)]  # fmt: skip
    own = [one.parameters[names[i]] for i in at]
    x = np.array([value for value, _, _ in own])
    covariance = np.diag([sigma**2 for _, sigma, _ in own])
    if one.result is not None and "borrowed" not in one.result:
        found = Calibration.from_json(one.result)
        rows = [found.names.index(names[i]) for i in at]
        covariance = found.covariance[np.ix_(rows, rows)]
    return at, x, covariance
