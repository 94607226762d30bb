"""Input of every estimator: window averages and the positions they were taken in.

Means and covariances are in device axes, in `samples.CHANNELS` order; positions and
angles are in procedure axes; ``mounting`` is P with procedure = P device, so that a
reference vector v of the procedure is P^T v for the device.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.calibration import Nominal
from fieldcal.core.base_motion import BaseMotion
from fieldcal.core.errors import InputError
from fieldcal.core.grade import Grade
from fieldcal.core.positions import (
    Position,
    alpha_beta_angles,
    specific_forces,
    table_rates,
)
from fieldcal.core.samples import ACC, CHANNELS, GYR, UNITS, Array, Index, Mask
from fieldcal.model import tolerances
from fieldcal.windows import Average


@dataclass(frozen=True, slots=True)
class Observations:
    """Averages of n windows with what is known about each.

    Attributes
    ----------
    positions : n positions, angles in rad
    mean : (n, 6) m/s^2 and rad/s, device axes; a sensor not measured is nan
        throughout, accelerometers may be where a table turns
    covariance : (n, 6, 6) of the means
    gravity : m/s^2
    temperature : (n,) deg C, nan where unknown
    time : (n,) middle of each window, s of device time, nan where unknown
    latitude : rad; None where unknown
    mounting : (3, 3) signed permutation, procedure = mounting @ device
    grade : "navigation" when the gyroscopes see the Earth's rate
    nominal : the calibration to start from

    Raises
    ------
    InputError
        If shapes do not fit, gravity is not positive, or a number is missing.

    """

    positions: tuple[Position, ...]
    mean: Array
    covariance: Array
    gravity: float
    temperature: Array = field(default_factory=lambda: np.empty(0))
    time: Array = field(default_factory=lambda: np.empty(0))
    latitude: float | None = None
    mounting: Array = field(default_factory=lambda: np.eye(3))
    grade: Grade = "tactical"
    nominal: Nominal = field(default_factory=Nominal)
    base_motion: BaseMotion = field(default_factory=BaseMotion)

    def __post_init__(self) -> None:
        n = len(self.positions)
        for name in ("temperature", "time"):
            if not np.size(getattr(self, name)):
                object.__setattr__(self, name, np.full(n, np.nan))
        self._check_shapes(n)
        if not (np.isfinite(self.gravity) and self.gravity > 0):
            raise InputError(
                f"gravity is {self.gravity:g} m/s^2: give the local value, about 9.8, "
                "or the latitude and height of the site"
            )
        self._check_numbers("accelerometers", ACC)
        self._check_numbers("gyroscopes", GYR)

    @classmethod
    def of(
        cls,
        positions: Sequence[Position],
        averages: Sequence[Average],
        gravity: float,
        *,
        latitude: float | None = None,
        mounting: Array | None = None,
        grade: Grade = "tactical",
        nominal: Nominal | None = None,
        base_motion: BaseMotion | None = None,
    ) -> Observations:
        """Gather the averages of windows; units and frames as in the attributes."""
        if not averages:
            raise InputError("there is no position with a window: take at least two")
        return cls(
            tuple(positions), np.array([a.mean for a in averages]),
            np.array([_regularised(a.covariance) for a in averages]), gravity,
            np.array([a.temperature for a in averages]),
            np.array([(a.start + a.end) / 2 for a in averages]), latitude,
            np.eye(3) if mounting is None else mounting, grade, nominal or Nominal(),
            base_motion or BaseMotion(),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, rows: Sequence[int] | Index) -> Observations:
        """Return the observations of some positions."""
        rows = np.asarray(rows, dtype=int)
        return replace(
            self, positions=tuple(self.positions[i] for i in rows),
            mean=self.mean[rows], covariance=self.covariance[rows],
            temperature=self.temperature[rows], time=self.time[rows],
        )  # fmt: skip

    @property
    def has_acc(self) -> bool:
        """Whether the accelerometers were measured where the device was at rest."""
        still = self.mean[~self.rotating, ACC]
        return bool(len(still) and np.isfinite(still).all())

    @property
    def has_gyr(self) -> bool:
        """Whether the gyroscopes were measured."""
        return bool(np.isfinite(self.mean[:, GYR]).all())

    @property
    def angles(self) -> tuple[Array, Array]:
        """Alpha and beta, (n,) rad each, nan where unknown."""
        return alpha_beta_angles(self.positions)

    @property
    def oriented(self) -> Mask:
        """Whether both angles of a position are known, (n,)."""
        return np.array([p.oriented for p in self.positions], dtype=bool)

    @property
    def rotating(self) -> Mask:
        """Whether a table turns a position, (n,)."""
        return np.array([p.on_turning_table for p in self.positions], dtype=bool)

    @property
    def forces(self) -> Array:
        """Specific force at rest in device axes, (n, 3) m/s^2."""
        return specific_forces(self.positions, self.gravity) @ self.mounting

    @property
    def known_latitude(self) -> float:
        """Latitude, rad.

        Raises
        ------
        InputError
            If it is not known.

        """
        if self.latitude is None:
            raise InputError(
                "the latitude is not known, so the Earth's rate cannot serve as the "
                "reference of the gyroscopes: give the latitude of the site"
            )
        return self.latitude

    @property
    def rates(self) -> Array:
        """Known rates of a rate table in device axes, (n, 3) rad/s; 0 at rest."""
        return table_rates(self.positions) @ self.mounting

    def _check_shapes(self, n: int) -> None:
        shapes = {
            "mean": (n, 6),
            "covariance": (n, 6, 6),
            "temperature": (n,),
            "time": (n,),
            "mounting": (3, 3),
        }
        for name, shape in shapes.items():
            actual = np.shape(getattr(self, name))
            if actual != shape:
                raise InputError(f"{name} is {actual} where {n} positions need {shape}")
        if n == 0:
            raise InputError("there is no position: mark at least two")

    def _check_numbers(self, sensor: str, three: slice) -> None:
        # accelerometers are not used while a rate table turns
        rows = np.flatnonzero(~self.rotating) if three == ACC else np.arange(len(self))
        mean = self.mean[rows, three]
        cov = self.covariance[rows, three, three]
        bad = ~np.isfinite(mean)
        if bad.all():
            return
        if bad.any():
            found, axis = np.argwhere(bad)[0]
            row = int(rows[found])
            raise InputError(
                f"position {row + 1} ({self.positions[row].name}) has no mean of "
                f"{CHANNELS[three][axis]}: take its window again or leave it out"
            )
        if not np.isfinite(cov).all() or (np.linalg.eigvalsh(cov) <= 0).any():
            raise InputError(_no_noise_text(sensor, mean, UNITS[three][0]))


def _no_noise_text(sensor: str, mean: Array, unit: str) -> str:
    """Error text for means (n, 3) of which some have no uncertainty."""
    if not mean.any(axis=0).all():
        return (
            f"the {sensor} read 0 {unit} in every sample at rest: the device, or the"
            " program that wrote this, sets them to zero while it is still, so their"
            " bias is not in the recording; switch this off (dead band, still"
            " detection, zero velocity update) and record again"
        )
    return (
        f"the {sensor}' means have no uncertainty above 0 {unit}: a window of repeated"
        " equal values tells nothing about its noise; record with more digits"
    )


def _regularised(covariance: Array) -> Array:
    """Drop correlations if they make the covariance of a short window singular."""
    out = covariance.copy()
    for three in (ACC, GYR):
        block = out[three, three]
        if not np.isfinite(block).all():
            continue
        size = np.sqrt(np.diag(block))
        if not (size > 0).all():
            continue
        least = np.linalg.eigvalsh(block / np.outer(size, size)).min()
        if least < tolerances.UNDETERMINED:
            out[three, three] = np.diag(size**2)
            out[:3, 3:] = out[3:, :3] = 0.0
    return out
