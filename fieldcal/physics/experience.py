"""Specific force, angular rate and other inputs of the device, row by row.

    f = P^T A(alpha, beta) f_base                        specific force, m/s^2
    w = P^T (A(alpha, beta) w_base + rate)               angular rate, rad/s

A is the turn (3), P the mounting (procedure = P device), f_base = (0, -g, 0) on a level
base, w_base the Earth's rate where the gyroscopes see it, `rate` what a rate table
adds; of the Earth's rate, what lies across that goes round with the table and averages
out. f and w are in device axes, f_base, w_base and rate in procedure axes. Source:
Avrutov and Pozniak 2023, (3), (4), (39); signs as in `fieldcal.core.frames`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from fieldcal.core.frames import (
    axis_projections,
    direction_cosines,
    each_in_procedure_axes,
    specific_force_at_home,
)
from fieldcal.core.samples import Array, Index
from fieldcal.physics.joint_turns import JointTurns

STEADY = 1e-3
"""Sine of the angle between rate and force up to which a turn leaves the force."""


@dataclass(frozen=True, slots=True)
class Experience:
    """Rows (windows, block means or samples) and the inputs of the device in each.

    Attributes
    ----------
    alpha, beta : (n,) rad, the turns; nan where not known
    gamma : (n,) rad, the third turn; 0 where there is none
    f : (n, 3) m/s^2, specific force in device axes
    w : (n, 3) rad/s, angular rate in device axes
    w_dot : (n, 3) rad/s^2, angular acceleration in device axes
    slope : (n, 6) m/s^3 and rad/s^2, by how much less f and w are followed for each
        second of a time constant; 0 where that is not known
    bend : (n, 6) the same of a low-pass of second order
    missed : (n, 6) m/s^2 and rad/s, by how much f and w change in the time that stamps
        are off the even times of the samples; 0 where that is not known
    f_dot, f_bend : (n, 3) m/s^3 and m/s^4, first and second derivative of f, of its
        components in device axes; 0 where they are not known
    w_bend : (n, 3) rad/s^3, second derivative of w; 0 where that is not known
    passed : (n, 6) m/s and rad, integral of the outputs since the start, over the
        nominal outputs per SI unit of their sensor; 0 where that is not known
    t : (n,) s, device time
    lasts : (n,) s, what each row is a mean over; 0 for samples
    since_start : (n,) s since the session's start
    since_turn : (n,) s since the device was last turned
    warming : (n,) K, temperature less that at the session's start; nan where unknown
    heating : (n,) K/s, rate of change of the temperature
    variance : (n, 3) (m/s^2)^2, of vibration on the accelerometers
    position : (n,) index of the position, -1 while the device is turned
    rate : (n, 3) rad/s about the procedure axes, what a rate table adds
    speed, speed_sigma : (n,) rad/s, length of `rate` and its ± where a table turns
        about an axis that nobody knows: `rate` is then along what was read; else 0
    base_force : (3,) m/s^2, specific force in base axes
    base_rate : (3,) rad/s, the Earth's rate in base axes; zero where it is left out
    transport : (3,) rad/s, what a base that moves over the Earth adds to it
    alpha_axis : (n, 3) axis of alpha, which is fixed in the base, in device axes where
        it is known beside the angles: while the device is turned; else nan
    joint_turns : when the joints that hold the device were turned, as far as is known
    mounting : (3, 3) P, procedure = P device
    latitude : rad; nan where unknown
    gravity_sigma : m/s^2, what is not known of gravity, 1 sigma
    clock_sigma : relative error of the times between two windows, 1 sigma
    attitude_sigma : (n,) rad about any axis, how well the position itself says that its
        turns are known; nan where it does not

    """

    alpha: Array
    beta: Array
    f: Array
    w: Array
    w_dot: Array
    slope: Array
    bend: Array
    missed: Array
    f_dot: Array
    f_bend: Array
    w_bend: Array
    passed: Array
    t: Array
    lasts: Array
    since_start: Array
    since_turn: Array
    warming: Array
    heating: Array
    variance: Array
    position: np.ndarray[Any, np.dtype[np.int_]]
    rate: Array
    speed: Array
    speed_sigma: Array
    base_force: Array
    base_rate: Array
    mounting: Array
    latitude: float
    gravity_sigma: float
    gamma: Array
    attitude_sigma: Array
    transport: Array
    alpha_axis: Array
    joint_turns: JointTurns = field(default_factory=JointTurns.none)
    clock_sigma: float = 0.0

    @classmethod
    def at_rest(cls, alpha: Array, beta: Array, gravity: float, **known: Any) -> Self:
        """Rows in known positions at rest; whatever else is known by its field's name.

        Parameters
        ----------
        alpha, beta : (n,) rad
        gravity : m/s^2

        >>> x = Experience.at_rest(np.array([0.0]), np.array([0.0]), 9.81)
        >>> x.f + 0.0
        array([[ 0.  , -9.81,  0.  ]])
        """
        alpha, beta = np.asarray(alpha, float), np.asarray(beta, float)
        n = len(alpha)
        unknown = {
            "f": np.full((n, 3), np.nan),
            "w": known.get("rate", np.zeros((n, 3))) @ known.get("mounting", np.eye(3)),
            "w_dot": np.zeros((n, 3)),
            "slope": np.zeros((n, 6)),
            "bend": np.zeros((n, 6)),
            "missed": np.zeros((n, 6)),
            "f_dot": np.zeros((n, 3)),
            "f_bend": np.zeros((n, 3)),
            "w_bend": np.zeros((n, 3)),
            "passed": np.zeros((n, 6)),
            "t": np.arange(n, dtype=float),
            "lasts": np.zeros(n),
            "since_start": np.arange(n, dtype=float),
            "since_turn": np.full(n, np.inf),
            "warming": np.zeros(n),
            "heating": np.zeros(n),
            "variance": np.zeros((n, 3)),
            "position": np.arange(n),
            "rate": np.zeros((n, 3)),
            "speed": np.zeros(n),
            "speed_sigma": np.zeros(n),
            "base_force": specific_force_at_home(gravity),
            "base_rate": np.zeros(3),
            "mounting": np.eye(3),
            "latitude": np.nan,
            "gravity_sigma": 0.0,
            "gamma": np.zeros(n),
            "attitude_sigma": np.full(n, np.nan),
            "transport": np.zeros(3),
            "alpha_axis": np.full((n, 3), np.nan),
        }
        return cls(alpha, beta, **(unknown | known)).turned()

    def __len__(self) -> int:
        return len(self.alpha)

    @property
    def gravity(self) -> float:
        """Local gravity, m/s^2."""
        return float(np.linalg.norm(self.base_force))

    @property
    def warms(self) -> bool:
        """Whether a thermometer shows that the temperature changes."""
        return bool(np.isfinite(self.warming).all() and np.ptp(self.warming) > 0)

    @property
    def oriented(self) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Rows whose both angles are known, (n,)."""
        known: np.ndarray[Any, np.dtype[np.bool_]] = np.isfinite(self.alpha + self.beta)
        return known

    @property
    def earth_seen(self) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Rows at rest, of unknown orientation, whose gyroscopes show the Earth's rate.

        (n,); on the way between two positions they show that the device is turned.
        """
        free = ~self.oriented & ~self.rate.any(axis=1) & (self.position >= 0)
        seen: np.ndarray[Any, np.dtype[np.bool_]] = free & self.w.any(axis=1)
        return seen

    @property
    def earth_unseen(self) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Rows in which the Earth's rate may point anywhere, (n,).

        Where a table turns, what is across its axis goes round, and what is along it is
        part of the speed.
        """
        turning = self.rate.any(axis=1)
        unseen: np.ndarray[Any, np.dtype[np.bool_]] = (
            ~self.oriented & ~turning & ~self.earth_seen
        )
        return unseen

    @property
    def force_known(self) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Rows in which the turning of a rate table does not turn the force, (n,)."""
        speed = np.linalg.norm(self.rate, axis=1)
        across = np.linalg.norm(np.cross(self.rate @ self.mounting, self.f), axis=1)
        steady = across <= STEADY * speed * self.gravity
        known: np.ndarray[Any, np.dtype[np.bool_]] = (speed == 0) | (
            self.oriented & steady
        )
        return known

    @property
    def to_device(self) -> Array:
        """Direction cosines from base to device axes, (n, 3, 3); nan where unknown."""
        return self.to_device_in(slice(None))

    def to_device_in(self, rows: Index | slice) -> Array:
        """The same in some rows."""
        third = self.gamma[rows] if self.gamma.any() else None
        turned = direction_cosines(self.alpha[rows], self.beta[rows], third)
        return np.asarray(self.mounting.T @ turned, float)

    def set_off(self, **angles: Array) -> Self:
        """The rows at other angles than stated, by errors of setting them.

        The axis of a rate table stays where it is in the base. In the device it is
        then elsewhere, and some of the table's rate comes in across. `angles` are some
        of alpha, beta and gamma, (n,) rad.
        """
        turning = self.rate.any(axis=1) & self.oriented
        if not turning.any():
            return self.turned(**angles)
        ends = []
        for of in ({}, angles):
            alpha, beta, gamma = (
                of.get(name, getattr(self, name))[turning]
                for name in ("alpha", "beta", "gamma")
            )
            ends.append(direction_cosines(alpha, beta, gamma))
        stated, real = ends
        rate = self.rate.copy()
        rate[turning] = np.einsum("nij,nkj,nk->ni", real, stated, rate[turning])
        return replace(self, rate=rate).turned(**angles)

    def turned(self, **changes: Any) -> Self:
        """Make the changes and bring f and w of the oriented rows up to date.

        `changes` are those of the angles, base_force, base_rate, and of f elsewhere.
        """
        alpha, beta, base_force, base_rate = (
            changes.get(name, getattr(self, name))
            for name in ("alpha", "beta", "base_force", "base_rate")
        )
        known = np.isfinite(alpha + beta)[:, None]
        if not known.any():
            return replace(self, **changes)
        gamma = changes.get("gamma", self.gamma)
        third = gamma if gamma.any() else None
        both = each_in_procedure_axes(alpha, beta, (base_force, base_rate), third)
        force, earth = (vector @ self.mounting for vector in both)
        if self.rate.any():
            table = self.rate @ self.mounting
            earth = table + (axis_projections(table) @ earth[:, :, None])[:, :, 0]
        if not known.all():
            force = np.where(known, force, changes.get("f", self.f))
            earth = np.where(known, earth, self.w)
        return replace(self, **(changes | {"f": force, "w": earth}))
