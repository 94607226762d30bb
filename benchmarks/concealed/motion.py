"""A device carried from position to position, in the time domain.

The operator turns the first joint (alpha, about z), then the second (beta, about the
turned x), each along a minimum-jerk path, waits, and holds. Base axes: x East, y down,
z North, right-handed. Written for the benchmark from the kinematics alone; it shares no
code with the estimators.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

EARTH = 7.292115e-5


@dataclass(frozen=True)
class Trip:
    """What the operator does: positions in degrees, times in s."""

    positions: tuple[tuple[float, float], ...]
    window_s: float = 30.0
    turn_s: float = 3.0
    wait_s: float = 3.0
    lead_s: float = 3.0
    rates_deg_s: tuple[tuple[float, float, float] | None, ...] = ()

    @property
    def windows(self) -> list[tuple[float, float]]:
        """Start and end of each window."""
        period = self.window_s + 2 * self.turn_s + self.wait_s
        starts = [self.lead_s + i * period for i in range(len(self.positions))]
        return [(s, s + self.window_s) for s in starts]

    @property
    def length_s(self) -> float:
        """Length of the recording."""
        return self.windows[-1][1]

    def rate(self, i: int) -> tuple[float, float, float] | None:
        """Rate of the table in a window, deg/s."""
        return self.rates_deg_s[i] if self.rates_deg_s else None


@dataclass
class Path:
    """The turns at some instants: angles, their rates and accelerations, rad."""

    t: Vector
    alpha: Vector
    beta: Vector
    d_alpha: Vector
    d_beta: Vector
    dd_alpha: Vector
    dd_beta: Vector
    arrived: Vector = field(default_factory=lambda: np.empty(0))


def _jerk(u: Vector) -> tuple[Vector, Vector, Vector]:
    u = np.clip(u, 0.0, 1.0)
    s = u**3 * (10 - 15 * u + 6 * u**2)
    ds = 30 * u**2 * (1 - u) ** 2
    dds = 60 * u * (1 - 3 * u + 2 * u**2)
    return s, ds, dds


def follow(trip: Trip, angles: Vector, t: Vector) -> Path:
    """Walk through the positions, (p, 2) rad as they are in truth."""
    alpha, beta = np.full((2, len(t)), angles[0][:, None])
    rates = np.zeros((4, len(t)))
    arrived = np.zeros(len(t))
    for i, (_, end) in enumerate(trip.windows[:-1]):
        step = angles[i + 1] - angles[i]
        for joint, (angle, begin) in enumerate(
            ((alpha, end), (beta, end + trip.turn_s))
        ):
            s, ds, dds = _jerk((t - begin) / trip.turn_s)
            angle += step[joint] * s
            rates[joint] += step[joint] * ds / trip.turn_s
            rates[2 + joint] += step[joint] * dds / trip.turn_s**2
        arrived[t >= end + 2 * trip.turn_s] = end + 2 * trip.turn_s
    da, db, dda, ddb = rates
    return Path(t, alpha, beta, da, db, dda, ddb, arrived)


def matrices(alpha: Vector, beta: Vector) -> Vector:
    """Base to body, (n, 3, 3)."""
    n = len(alpha)
    about_z = np.tile(np.eye(3), (n, 1, 1))
    about_z[:, 0, 0] = about_z[:, 1, 1] = np.cos(alpha)
    about_z[:, 0, 1] = np.sin(alpha)
    about_z[:, 1, 0] = -np.sin(alpha)
    about_x = np.tile(np.eye(3), (n, 1, 1))
    about_x[:, 1, 1] = about_x[:, 2, 2] = np.cos(beta)
    about_x[:, 1, 2] = np.sin(beta)
    about_x[:, 2, 1] = -np.sin(beta)
    return about_x @ about_z


def rates(path: Path) -> tuple[Vector, Vector]:
    """Angular rate and acceleration against the base, body axes, (n, 3) each."""
    cb, sb = np.cos(path.beta), np.sin(path.beta)
    w = np.column_stack([path.d_beta, sb * path.d_alpha, cb * path.d_alpha])
    w_dot = np.column_stack(
        [
            path.dd_beta,
            sb * path.dd_alpha + cb * path.d_beta * path.d_alpha,
            cb * path.dd_alpha - sb * path.d_beta * path.d_alpha,
        ]
    )
    return w, w_dot


def small_turn(vectors: Vector, rotation: Vector) -> Vector:
    """Vectors seen from axes turned by a small rotation vector, rad."""
    return vectors - np.cross(rotation, vectors)


def tilted(about_x_deg: float, about_z_deg: float) -> Vector:
    """Turn about z, then about x, (3, 3)."""
    a, b = np.deg2rad([about_z_deg, about_x_deg])
    out: Vector = matrices(np.array([a]), np.array([b]))[0]
    return out
