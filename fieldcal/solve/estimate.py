"""What one estimator found, and how estimates of two sensors become a calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration, Method, Nominal
from fieldcal.calibration.gauge import GROUPS
from fieldcal.errors import NotObservable
from fieldcal.samples import Array
from fieldcal.solve.linear import Mask
from fieldcal.solve.observations import ACC, GYR, Index, Observations

UNITS = {group: unit for group, (_, _, unit) in GROUPS.items()}
UNITS |= {"angle_offset": "deg", "base_tilt": "deg"}
"""Unit of each group's components."""

OFF_DIAGONAL = ("12", "13", "21", "23", "31", "32")
"""Components of a cross-coupling: first the channel, then the axis that reaches it."""

LEAST, UNSEEN = 0.1, 5.0
"""Share of the nominal scale factor, and standard deviations: less is none."""

NO_DOF = "no degree of freedom: the residual says nothing; add a verification position"


@dataclass(frozen=True, slots=True)
class Estimate:
    """Parameters of one sensor.

    Attributes
    ----------
    names : (p,) full names, ``group.component``
    values, covariance : (p,), (p, p); only what was determined
    chi2, dof : of the residual
    rms : root mean square residual, unit of the sensor; weighted as in the fit where
        the windows differ
    gain : (p, n, 3) derivative of the values by the sensor's means; None if unknown
    warnings : what the user must know
    extra : figures that belong to the method

    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    chi2: float = 0.0
    dof: int = 0
    rms: float = np.nan
    gain: Array | None = None
    warnings: tuple[str, ...] = ()
    extra: Mapping[str, Any] = field(default_factory=dict)

    def only(self, kept: Mask) -> Estimate:
        """Keep some of the parameters, (p,) bool."""
        return self.at(np.flatnonzero(kept).tolist())

    def at(self, rows: Sequence[int]) -> Estimate:
        """Parameters by their number, in that order."""
        return replace(
            self,
            names=tuple(self.names[i] for i in rows),
            values=self.values[rows],
            covariance=self.covariance[np.ix_(rows, rows)],
            gain=None if self.gain is None else self.gain[rows],
        )

    def spread(self, rows: Index, n: int) -> Estimate:
        """Place the gain of some windows among all n."""
        if self.gain is None:
            return self
        whole = np.zeros((len(self.names), n, 3))
        whole[:, rows] = self.gain
        return replace(self, gain=whole)


def combine(
    method: Method,
    observations: Observations,
    acc: Estimate | None,
    gyr: Estimate | None,
    warnings: Sequence[str] = (),
    good: bool = True,
) -> Calibration:
    """Put the estimates of both sensors into one calibration.

    Raises
    ------
    NotObservable
        If neither sensor has a parameter.

    """
    parts = [e for e in (acc, gyr) if e is not None and e.names]
    notes = [*warnings, *(w for e in (acc, gyr) if e is not None for w in e.warnings)]
    if not parts:
        raise NotObservable(
            "these positions determine nothing: " + "; ".join(notes or ["no sensor"])
        )
    odd = [said for e in parts for said in _senseless(e, observations.nominal)]
    names = tuple(n for e in parts for n in e.names)
    fit = acc if acc is not None and acc.names else parts[0]
    return Calibration(
        method=method,
        names=names,
        values=np.concatenate([e.values for e in parts]),
        covariance=_joined(parts, observations),
        units=tuple(UNITS[n.partition(".")[0]] for n in names),
        chi2=fit.chi2,
        dof=fit.dof,
        rms=fit.rms if fit is acc else np.nan,
        warnings=tuple(dict.fromkeys([*odd, *notes])),
        good=good and not odd,
        info={"conditions": _conditions(observations), **_extra(acc, gyr)},
    )


def _senseless(estimate: Estimate, nominal: Nominal) -> list[str]:
    """Scale factors that no sensor in the declared axes can have, a sentence each."""
    said = []
    for i, name in enumerate(estimate.names):
        group, _, axis = name.partition(".")
        if group not in ("acc_scale", "gyr_scale"):
            continue
        usual = getattr(nominal, group)["xyz".index(axis)]
        value, sigma = estimate.values[i], float(estimate.covariance[i, i] ** 0.5)
        if abs(value) < min(UNSEEN * sigma, LEAST * abs(usual)):
            said.append(
                f"{name} is {value:.2g} ± {sigma:.2g}: the output does not follow at"
                " all; was the device turned as session.toml says?"
            )
        elif value / usual < 0 and abs(value) > UNSEEN * sigma:
            said.append(
                f"{name} is {value:.3g}, nominal {usual:.3g}: the axis points"
                " the other way; mend [frame] mounting, or the signs of the angles or"
                " rates"
            )
    return said


def _joined(parts: Sequence[Estimate], observations: Observations) -> Array:
    """Joint covariance; the noise that both sensors share couples them."""
    sizes = [len(e.values) for e in parts]
    whole = np.zeros((sum(sizes), sum(sizes)))
    first = 0
    for e, size in zip(parts, sizes, strict=True):
        whole[first : first + size, first : first + size] = e.covariance
        first += size
    if len(parts) == 2 and parts[0].gain is not None and parts[1].gain is not None:
        # where a table turns there is nothing of the accelerometers
        shared = np.nan_to_num(observations.covariance[:, ACC, GYR])
        cross = np.einsum(
            "pnc,ncd,qnd->pq", parts[0].gain, shared, parts[1].gain, optimize=True
        )
        whole[: sizes[0], sizes[0] :] = cross
        whole[sizes[0] :, : sizes[0]] = cross.T
    return whole


def _conditions(observations: Observations) -> dict[str, Any]:
    known = observations.temperature[np.isfinite(observations.temperature)]
    latitude = observations.latitude
    return {
        "positions": len(observations),
        "gravity": observations.gravity,
        "latitude_deg": None if latitude is None else float(np.rad2deg(latitude)),
        "temperature_degc": float(known.mean()) if len(known) else None,
        "grade": observations.grade,
    }


def _extra(acc: Estimate | None, gyr: Estimate | None) -> dict[str, Any]:
    out: dict[str, Any] = {}
    if acc is not None:
        out |= acc.extra
    if gyr is not None and gyr.names:
        out["gyroscopes"] = {
            "chi2": gyr.chi2,
            "dof": gyr.dof,
            "rms": gyr.rms,
            "unit": "rad/s",
            **gyr.extra,
        }
    return out


def axes(group: str) -> tuple[str, ...]:
    """Full names of x, y, z of a group."""
    return tuple(f"{group}.{axis}" for axis in "xyz")


def join(words: Sequence[str]) -> str:
    """Words as a list in a sentence."""
    return ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else words[0]


def not_determined(missing: Sequence[str], remedy: Sequence[str], what: str) -> str:
    """Sentence that names parameters the data leave open, and what would fix it."""
    verb = "are" if len(missing) > 1 else "is"
    cure = f": add {join(remedy)}" if remedy else ""
    return f"{join(missing)} {verb} not determined by {what}{cure}"
