"""A calibration: parameters with their covariance and provenance.

Parameters are grouped under an id. ``acc_bias``, ``acc_scale``, ``gyr_bias``,
``gyr_scale`` have the components x, y, z of the device's axes; effects stand under
their id of the catalogue with its parameter names, e.g. ``cross_coupling.k12``. A
parameter that was not determined is absent; none is filled in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from fieldcal.calibration.correction import calibrated_samples, calibrated_sigma
from fieldcal.calibration.names import ParameterName, group_of
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block

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
            if name in ("acc_scale", "gyr_scale") and not np.all(three):
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
    def is_checked(self) -> bool:
        """Whether more was measured than was estimated, so that data could disagree."""
        return self.dof > 0 or not np.isfinite(self.chi2)

    @property
    def groups(self) -> tuple[str, ...]:
        """The ids present, in order."""
        return tuple(dict.fromkeys(group_of(n) for n in self.names))

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Full names of the biases and scale factors that were not determined."""
        every = (
            f"{group}.{a}" for group, (axes, _) in COMPONENTS.items() for a in axes
        )
        return tuple(name for name in every if name not in self.names)

    def components(self, group: str) -> tuple[str, ...]:
        """Component names of a group that were determined."""
        parsed = map(ParameterName.of, self.names)
        return tuple(name.component for name in parsed if name.group == group)

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

    def accelerometers(self, nominal: Nominal | None = None) -> tuple[Array, Array]:
        """Bias (3,) and matrix (3, 3) of U = bias + matrix f.

        What was not determined is nan, or the nominal value where that is given; a
        cross-coupling that was not determined is 0.
        """
        three = (np.nan,) * 3
        bias = nominal.acc_bias if nominal else three
        scale = nominal.acc_scale if nominal else three
        return self._linear("acc", "cross_coupling", bias, scale)

    def gyroscopes(self, nominal: Nominal | None = None) -> tuple[Array, Array]:
        """Bias (3,) and matrix (3, 3) of W = bias + matrix w, like `accelerometers`."""
        three = (np.nan,) * 3
        bias = nominal.gyr_bias if nominal else three
        scale = nominal.gyr_scale if nominal else three
        return self._linear("gyr", "gyro_cross_coupling", bias, scale)

    def _linear(
        self,
        sensor: str,
        cross: str,
        nominal_bias: Sequence[float],
        nominal_scale: Sequence[float],
    ) -> tuple[Array, Array]:
        bias, _ = self.vector(f"{sensor}_bias")
        scale, _ = self.vector(f"{sensor}_scale")
        bias = np.where(np.isfinite(bias), bias, nominal_bias)
        matrix = np.diag(np.where(np.isfinite(scale), scale, nominal_scale))
        for part in self.components(cross):
            name = ParameterName(cross, part)
            matrix[name.entry] = self.value(str(name))
        return bias, matrix

    def apply(self, block: Block, nominal: Nominal | None = None) -> Block:
        """Return the block with bias, scale factor and cross-coupling taken out.

        Parameters
        ----------
        block : raw samples, device axes
        nominal : values for what was not determined; bias 0 and scale 1 if not given

        """
        start = nominal or Nominal()
        return replace(
            block,
            acc=calibrated_samples(block.acc, *self.accelerometers(start)),
            gyr=calibrated_samples(block.gyr, *self.gyroscopes(start)),
        )

    def uncertainty_of(self, block: Block, nominal: Nominal | None = None) -> Array:
        """Standard uncertainty that the calibration leaves in `apply`, (n, 6).

        Parameters as in `apply`. A nominal value counts as exact, and the noise of the
        samples is not in it.
        """
        start = nominal or Nominal()
        parts = [
            calibrated_sigma(values, *model, self.names, self.covariance, sensor)
            for sensor, values, model in (
                ("acc", block.acc, self.accelerometers(start)),
                ("gyr", block.gyr, self.gyroscopes(start)),
            )
        ]
        return np.hstack(parts)

    def to_json(self) -> dict[str, Any]:
        """Return the object of ``result.json``; numbers not determined are null."""
        from fieldcal.calibration.document import to_json

        return to_json(self)

    @classmethod
    def from_json(cls, document: Any) -> Calibration:
        """Read the object of ``result.json``.

        Raises
        ------
        InputError
            If it is not one; the text names the key.

        """
        from fieldcal.calibration.document import from_json

        return from_json(document)
