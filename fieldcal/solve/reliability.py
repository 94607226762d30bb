"""Effect of wrong angles on a result, and how well they would be noticed.

The true angles differ from the stated ones by u: a detent is worn, a gauge is too long,
two positions are exchanged. With V the stated covariance of the angles, P the
covariance of the estimate, index a for the angles and t for a parameter,

    l^2 = u^T (V^-1 - V^-1 P_aa V^-1) u,     d t = -P_ta V^-1 u                    (1)

l^2 is the non-centrality of chi-squared, by which the mistake is noticed, and d t the
change of the parameter. Source: W. Baarda, A testing procedure for use in geodetic
networks, 1968: internal and external reliability.

Three kinds of mistakes are considered, each with the largest size that operators and
fixtures make: one position, one angle in all positions that repeat it, and all angles
of a joint in proportion.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors
from fieldcal.model.posterior.mixture import Mixture
from fieldcal.solve.parameter_set import ParameterSet

JOINTS = ("α", "β")


@dataclass(frozen=True, slots=True)
class WrongAngles:
    """A mistake of set angles at its largest size.

    Attributes
    ----------
    joint : index of the joint
    angle_deg : angle that is wrong wherever it is set; None for a single position, or
        for all angles in proportion
    position : number of the single wrong position, from 0; None for several
    shows : l of (1), how well the mistake shows
    moves : d t of (1), shift of each parameter by full name

    """

    joint: int
    angle_deg: float | None
    position: int | None
    shows: float
    moves: Mapping[str, float]

    @property
    def description(self) -> str:
        """The mistake in words."""
        name = JOINTS[self.joint]
        if self.position is not None:
            return f"position {self.position + 1} with a wrong {name}"
        if self.angle_deg is not None:
            by = f"{priors.REPEATED_MISTAKE_DEG:g}° off each time"
            return f"{name} = {self.angle_deg:.4g}° set {by}"
        return f"every {name} set {priors.GAUGE_ERROR:.1%} too far"

    def error_at(self, alpha: float, beta: float) -> tuple[float, float]:
        """Error of the angles of another position by the same mistake, rad."""
        angle = (alpha, beta)[self.joint]
        off = 0.0
        if self.position is None and self.angle_deg is None:
            off = priors.GAUGE_ERROR * angle
        elif self.angle_deg is not None and _equal_angles(
            angle, np.deg2rad(self.angle_deg)
        ):
            off = float(np.deg2rad(priors.REPEATED_MISTAKE_DEG))
        return (off, 0.0) if self.joint == 0 else (0.0, off)

    def to_json(self) -> dict[str, Any]:
        """Return the object of result.json."""
        return asdict(self)

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> WrongAngles:
        """Read what `to_json` wrote."""
        return cls(**value)


def wrong_angles(
    parameter_set: ParameterSet, mixture: Mixture, names: tuple[str, ...], picked: Array
) -> list[WrongAngles]:
    """Effects of all possible mistakes of angles on an estimate.

    Parameters
    ----------
    parameter_set, mixture : the set and its posterior
    names : (k,) parameters
    picked : (k, c) derivative of the parameters by the columns of the estimate

    """
    given = (g for _, g in parameter_set.base_members if g.cause == "angle_setting")
    own = [g for g in given if g.part == "own"]
    if not own:
        return []
    order = np.argsort(mixture.columns)
    at = order[np.searchsorted(mixture.columns, own[0].columns, sorter=order)]
    weight = 1 / mixture.prior_sigma[at] ** 2
    covariance = mixture.covariance[np.ix_(at, at)]
    shown = np.diag(weight) - weight[:, None] * covariance * weight
    moved = -picked @ mixture.covariance[:, at] * weight
    places: Index = (own[0].columns[::2] - parameter_set.small_rotation) // 2
    out = []
    for joint, angle, position, u in _mistakes(parameter_set, places):
        shows = max(float(u @ shown @ u), 0.0) ** 0.5
        moves = dict(zip(names, (moved @ u).tolist(), strict=True))
        out.append(WrongAngles(joint, angle, position, shows, moves))
    return out


def _mistakes(
    parameter_set: ParameterSet, places: Index
) -> Iterator[tuple[int, float | None, int | None, Array]]:
    """Joint, angle, position and errors of all angles, (2 p,) rad, of each mistake."""
    x = parameter_set.x
    rows = [int(np.argmax(x.position == p)) for p in places]
    for joint, angles in enumerate((x.alpha[rows], x.beta[rows])):
        for i, place in enumerate(places.tolist()):
            u = np.zeros(2 * len(places))
            u[2 * i + joint] = np.deg2rad(priors.SINGLE_MISTAKE_DEG)
            yield joint, None, int(place), u
        for value in np.unique(np.round(angles, 9)).tolist():
            u = np.zeros(2 * len(places))
            u[joint::2] = np.deg2rad(priors.REPEATED_MISTAKE_DEG) * _equal_angles(
                angles, value
            )
            yield joint, float(np.rad2deg(value)), None, u
        u = np.zeros(2 * len(places))
        u[joint::2] = priors.GAUGE_ERROR * angles
        if u.any():
            yield joint, None, None, u


def _equal_angles(angle: Any, value: float) -> Any:
    return np.abs(angle - value) < 1e-8
