"""What a lot says of its next unit, from its units' results: hierarchical priors.

A unit's parameters theta_i are of its lot, and its result x_i of its own rows:

    theta_i ~ N(mu, S),   x_i ~ N(theta_i, C_i)                                    (1)

What mu and S may be is found by Gibbs' sampler, with the prior of Huang and Wand on S,
which has every correlation equally likely and spreads of any size; in units of s,

    mu | S ~ N(G^-1 sum_i (S + C_i)^-1 x_i, G^-1),   G = sum_i (S + C_i)^-1        (2)
    theta_i | rest ~ N(V_i (S^-1 mu + C_i^-1 x_i), V_i),  V_i = (S^-1 + C_i^-1)^-1 (3)
    1 / a_j | rest ~ Gamma((f + k) / 2, rate f (S^-1)_jj + 1 / A^2)                (4)
    S | rest ~ IW(f + n + k - 1, sum_i (theta_i - mu)(theta_i - mu)^T + 2 f / a)   (5)

and of the next unit mean and covariance are <mu> and <S> + cov mu, which has in it what
few units leave open. Units that are odd in a parameter (`spread`) have no say. Source:
Gelman and others, Bayesian Data Analysis, 5 and 15; Huang and Wand, Bayesian Analysis 8
(2013) 439.
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
from fieldcal.core.samples import Array
from fieldcal.fleet.lot import FEWEST, last_of_units
from fieldcal.fleet.spread import WIDER, UnitSpread, spread
from fieldcal.history.sessions import StoredSession, values

DRAWS, FIRST = 2000, 200
"""Of the sampler, and those before it has forgotten where it began."""

MOST = 150
"""Units of a lot that are asked for spreads, which they tell to 6 %."""

SHAPE = 2.0
"""f: correlations are equally likely."""

LARGE = 10.0
"""A: spreads may be so many times what they seem."""

BY_GRAVITY = "acc_scale"
"""What is measured by gravity, so that units of one place may all be wrong alike."""


def lot_prior(
    label: str, sessions: Sequence[StoredSession], serial: str = "", folder: str = ""
) -> LotPrior:
    """What a lot says of a unit.

    Parameters
    ----------
    label : which lot, as it is to be called
    sessions : of the lot, with their documents
    serial, folder : of the unit and of its session, which have no say in it

    Raises
    ------
    InputError
        If fewer than `FEWEST` other units know any parameter.

    """
    others = [
        one for one in sessions
        if one.folder != folder and not (serial and one.serial == serial)
    ]  # fmt: skip
    units = [one for one in last_of_units(others) if one.good]
    found: dict[str, UnitSpread] = {}
    for name in dict.fromkeys(n for one in units for n in one.parameters):
        x, sigma = values([one for one in units if _counts(one, name)], name)
        known = np.isfinite(x) & (sigma > 0)
        if known.sum() >= FEWEST and group_of(name) in GROUPS:
            found[name] = spread(x[known], sigma[known])
    if not found:
        raise InputError(
            f"{label}: {len(units)} other units have a good result, a lot needs"
            f" {FEWEST}: run fieldcal batch on more sessions, ask for fewer conditions,"
            " or leave --lot out"
        )
    names, about = tuple(found), list(found.values())
    mean, covariance = np.zeros(len(names)), np.zeros((len(names),) * 2)
    for sensor in (0, 1):
        at = [i for i, n in enumerate(names) if GROUPS[group_of(n)][0] == sensor]
        if at:
            some = [names[i] for i in at]
            told = _Told.of(units, some, [about[i] for i in at])
            mean[at], covariance[np.ix_(at, at)] = told.next_unit()
    return LotPrior(
        label,
        names,
        mean,
        covariance,
        np.array([one.odd for one in about]),
        WIDER,
        tuple(len(one.typical) for one in about),
    )


def _counts(one: StoredSession, name: str) -> bool:
    """Whether a unit's value says something of its lot.

    A scale factor does where gravity was known, by latitude and height.
    """
    if group_of(name) != BY_GRAVITY:
        return True
    result: Mapping[str, Any] = one.result or {}
    latitude = result.get("conditions", {}).get("latitude_deg")
    return latitude is not None and "height_m" in result.get("site", {})


@dataclass(frozen=True, slots=True)
class _Told:
    """What units say of some parameters.

    Attributes
    ----------
    middle, size : (k,) in which everything here is: parameter = middle + size z
    told, pull : (n, k, k), (n, k) C^-1 and C^-1 x of each unit

    """

    middle: Array
    size: Array
    told: Array
    pull: Array

    @classmethod
    def of(
        cls,
        units: Sequence[StoredSession],
        names: Sequence[str],
        about: Sequence[UnitSpread],
    ) -> _Told:
        """Of units that are not odd."""
        middle = np.array([one.mean for one in about])
        size = np.sqrt([one.square + one.mean_sigma**2 for one in about])
        k = len(names)
        every, pulls = [], []
        for one in units:
            at, x, covariance = _own(one, names)
            scaled = covariance / size[at] / size[at][:, None]
            z = (x - middle[at]) / size[at]
            usual = np.abs(z) / np.sqrt(1 + np.diag(scaled))
            if not at or usual.max() > WIDER / 2:
                continue
            told, pull = np.zeros((k, k)), np.zeros(k)
            told[np.ix_(at, at)] = np.linalg.inv(scaled)
            pull[at] = told[np.ix_(at, at)] @ z
            every.append(told)
            pulls.append(pull)
        some = np.linspace(0, len(every) - 1, min(len(every), MOST)).round().astype(int)
        return cls(middle, size, np.array(every)[some], np.array(pulls)[some])

    def next_unit(self) -> tuple[Array, Array]:
        """Mean and covariance of the next unit, (k,) and (k, k)."""
        rng = np.random.default_rng(1)
        n, k = self.pull.shape
        spread_: Array = np.eye(k)
        means, spreads = [], []
        for draw in range(FIRST + DRAWS):
            inverse = np.linalg.inv(spread_)
            root = np.linalg.cholesky(inverse + self.told)
            half = np.linalg.solve(root, self.told)
            both = np.linalg.inv((self.told - half.transpose(0, 2, 1) @ half).sum(0))
            seen = np.linalg.solve(root, self.pull[..., None])
            pull = (self.pull - (half.transpose(0, 2, 1) @ seen)[..., 0]).sum(axis=0)
            mu = rng.multivariate_normal(both @ pull, both)  # (2)
            white = np.linalg.solve(root, (self.pull + inverse @ mu)[..., None])
            white += rng.standard_normal((n, k, 1))
            theta = np.linalg.solve(root.transpose(0, 2, 1), white)[..., 0]  # (3)
            rate = SHAPE * np.diag(inverse) + LARGE**-2
            over = rng.gamma((SHAPE + k) / 2, 1 / rate)  # (4)
            off = theta - mu
            whole = off.T @ off + 2 * SHAPE * np.diag(over)
            spread_ = _inverse_wishart(rng, SHAPE + n + k - 1, whole)  # (5)
            if draw >= FIRST:
                means.append(mu)
                spreads.append(spread_)
        covariance = np.mean(spreads, axis=0) + np.cov(np.array(means).T)
        mean: Array = np.mean(means, axis=0)
        return (
            self.middle + self.size * mean,
            covariance * self.size * self.size[:, None],
        )


def _inverse_wishart(rng: np.random.Generator, dof: float, scale: Array) -> Array:
    """Draw one by Bartlett's decomposition, (k, k)."""
    k = len(scale)
    lower = np.tril(rng.standard_normal((k, k)), -1)
    lower += np.diag(np.sqrt(rng.chisquare(dof - np.arange(k))))
    root = np.linalg.solve(lower, np.linalg.cholesky(scale).T)
    out: Array = root.T @ root
    return out


def _own(one: StoredSession, names: Sequence[str]) -> tuple[list[int], Array, Array]:
    """Which parameters a unit knows by itself, their values and covariance."""
    at = [i for i, name in enumerate(names)
          if name in one.parameters and _counts(one, name)]  # fmt: skip
    own = [one.parameters[names[i]] for i in at]
    x = np.array([value for value, _, _ in own])
    covariance = np.diag([sigma**2 for _, sigma, _ in own])
    if one.result is not None and "borrowed" not in one.result:
        found = Calibration.from_json(one.result)
        rows = [found.names.index(names[i]) for i in at]
        covariance = found.covariance[np.ix_(rows, rows)]
    return at, x, covariance
