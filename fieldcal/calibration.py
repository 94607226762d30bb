"""What a calibration is: parameters with their covariance, and where they come from.

Parameters are grouped under an id. ``acc_bias``, ``acc_scale``, ``gyr_bias``,
``gyr_scale`` have the components x, y, z of the device's axes; effects stand under
their id of the catalogue with its parameter names, e.g. ``cross_coupling.k12``. A
parameter that was not determined is absent; none is filled in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from fieldcal.errors import InputError
from fieldcal.samples import Array

FORMAT = 1

Method = Literal["two_position", "five_position", "least_squares", "joint", "scalar"]

COMPONENTS: dict[str, tuple[tuple[str, ...], str]] = {
    "acc_bias": (("x", "y", "z"), "m/s^2"),
    "acc_scale": (("x", "y", "z"), "1"),
    "gyr_bias": (("x", "y", "z"), "rad/s"),
    "gyr_scale": (("x", "y", "z"), "1"),
}
"""Component names and unit of the groups that are always reported in device axes."""


@dataclass(frozen=True, slots=True)
class Nominal:
    """The calibration to start from, in device axes: U = bias + scale f.

    Attributes
    ----------
    acc_bias, gyr_bias : (3,) m/s^2, rad/s
    acc_scale, gyr_scale : (3,) without unit

    """

    acc_bias: tuple[float, ...] = (0.0, 0.0, 0.0)
    acc_scale: tuple[float, ...] = (1.0, 1.0, 1.0)
    gyr_bias: tuple[float, ...] = (0.0, 0.0, 0.0)
    gyr_scale: tuple[float, ...] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        for name in ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale"):
            three = getattr(self, name)
            if len(three) != 3 or not np.isfinite(three).all():
                raise InputError(f"nominal {name} is {three}: give three numbers")
            if name.endswith("scale") and not np.all(three):
                raise InputError(
                    f"nominal {name} is {three}: a scale of 0 sees nothing"
                )


@dataclass(frozen=True, slots=True)
class Calibration:
    """Parameters, their covariance, and how well the data agree with them.

    Attributes
    ----------
    method : how they were estimated
    names : (k,) full names, ``group.component``
    values : (k,) in the units below
    covariance : (k, k)
    units : (k,) unit of each value
    chi2, dof : weighted sum of squared residuals, and observations less parameters
    rms : root mean square residual of the accelerometers, m/s^2
    warnings : what the user must know, one sentence each
    good : whether the numbers can be used
    info : provenance: device, place, temperature, versions

    """

    method: Method
    names: tuple[str, ...]
    values: Array
    covariance: Array
    units: tuple[str, ...]
    chi2: float
    dof: int
    rms: float
    warnings: tuple[str, ...] = ()
    good: bool = True
    info: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        k = len(self.names)
        if np.shape(self.values) != (k,) or np.shape(self.covariance) != (k, k):
            raise InputError(f"{k} names do not fit the values and their covariance")

    @property
    def sigma(self) -> Array:
        """Standard uncertainty of each value, (k,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def groups(self) -> tuple[str, ...]:
        """The ids present, in order."""
        return tuple(dict.fromkeys(n.partition(".")[0] for n in self.names))

    def components(self, group: str) -> tuple[str, ...]:
        """Component names of a group that were determined."""
        parts = [n.partition(".") for n in self.names]
        return tuple(c for g, _, c in parts if g == group)

    def value(self, name: str) -> float:
        """One value by its full name; nan where it was not determined."""
        return self._pick(self.values, name)

    def uncertainty(self, name: str) -> float:
        """Standard uncertainty of one value; nan where it was not determined."""
        return self._pick(self.sigma, name)

    def vector(self, group: str) -> tuple[Array, Array]:
        """Values and sigmas of a group, (3,) or as many as were determined.

        The groups of `COMPONENTS` always come whole, nan where not determined.
        """
        parts = COMPONENTS[group][0] if group in COMPONENTS else self.components(group)
        full = [f"{group}.{part}" for part in parts]
        values = np.array([self.value(n) for n in full])
        return values, np.array([self.uncertainty(n) for n in full])

    def _pick(self, numbers: Array, name: str) -> float:
        return float(numbers[self.names.index(name)]) if name in self.names else np.nan

    def to_json(self) -> dict[str, Any]:
        """Return the object of ``result.json``; numbers not determined are null."""
        return {
            "format": FORMAT,
            "method": self.method,
            "verdict": "good" if self.good else "bad",
            "warnings": list(self.warnings),
            "parameters": {g: self._group_json(g) for g in self.groups},
            "covariance": {
                "names": list(self.names),
                "matrix": np.asarray(self.covariance).tolist(),
            },
            "fit": {
                "chi2": _number(self.chi2),
                "dof": self.dof,
                "rms": _number(self.rms),
                "unit": "m/s^2",
            },
            **self.info,
        }

    def _group_json(self, group: str) -> dict[str, Any]:
        values, sigmas = self.vector(group)
        first = next(i for i, n in enumerate(self.names) if n.startswith(group + "."))
        units = {u for n, u in zip(self.names, self.units, strict=True)
                 if n.startswith(group + ".")}  # fmt: skip
        out: dict[str, Any] = {
            "value": [_number(v) for v in values],
            "sigma": [_number(s) for s in sigmas],
            "unit": self.units[first],
        }
        if group not in COMPONENTS:
            out["names"] = list(self.components(group))
        if len(units) > 1:
            out["units"] = [
                u for n, u in zip(self.names, self.units, strict=True)
                if n.startswith(group + ".")
            ]  # fmt: skip
        return out


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def names_of(group: str, components: Sequence[str] = ("x", "y", "z")) -> list[str]:
    """Full names of a group's components."""
    return [f"{group}.{part}" for part in components]
