"""Growth of the errors of an inertial navigator at rest, in base axes.

    phi' = -W x phi + (u x dv) / R - e                       attitude               (1)
    dv'  = f x phi + a - 2 W x dv + 2 g (dp . d) d / R       velocity               (2)
    dp'  = dv                                                position               (3)

with the computed attitude C' = (1 - [phi x]) C, e and a errors of rates and forces, W
the Earth's rate, f = -g d, d down and u up. e and a are constant in one run, and white
noise beside. With x = (phi, dv, dp), F the matrix of (1) to (3), from x_0 on

    x(t) = exp(F t) x_0 + int exp(F s) ds G (e, a)                                  (4)
    P(t + s) = exp(F s) P(t) exp(F s)^T + Q(s),  cov(x(t + s), x(t)) = exp(F s) P(t) (5)

Symbols: R the Earth's radius, Q what white noise adds (van Loan 1978). SI units, base
axes: x East, y down, z north. Source: D. Titterton and J. Weston, Strapdown Inertial
Navigation Technology, 2nd edition, 12.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from fieldcal.core.frames import specific_force_at_home
from fieldcal.core.rotation import cross_matrix
from fieldcal.core.samples import Array

EARTH_RADIUS = 6.371e6
"""Mean radius, m: Schuler's period is known to a part in three hundred."""

DOWN = np.array([0.0, 1.0, 0.0])

PHI, VELOCITY, POSITION = slice(0, 3), slice(3, 6), slice(6, 9)
"""Indices of attitude, velocity and position in x."""


def error_dynamics(earth: Array, gravity: float) -> Array:
    """F of (1) to (3), (9, 9), by the Earth's rate (3,) rad/s and gravity, m/s^2."""
    f = np.zeros((9, 9))
    f[PHI, PHI] = -cross_matrix(earth)
    f[PHI, VELOCITY] = cross_matrix(-DOWN) / EARTH_RADIUS  # (1)
    f[VELOCITY, PHI] = cross_matrix(specific_force_at_home(gravity))
    f[VELOCITY, VELOCITY] = -2 * cross_matrix(earth)
    f[VELOCITY, POSITION] = 2 * gravity / EARTH_RADIUS * np.outer(DOWN, DOWN)  # (2)
    f[POSITION, VELOCITY] = np.eye(3)  # (3)
    return f


@dataclass(frozen=True, slots=True)
class ErrorPropagation:
    """Effect of errors on x at the m instants step, 2 step, ... of a run.

    Attributes
    ----------
    start : (m, 9, 9) derivative by x at the start
    constant : (m, 9, 6) derivative by constant errors of rates and forces
    rate_noise, force_noise : (9 m, 9 m) covariance by white noise of 1 rad/s/sqrt(Hz)
        and 1 m/s^2/sqrt(Hz) about and along each axis

    """

    start: Array
    constant: Array
    rate_noise: Array
    force_noise: Array


def propagate_errors(f: Array, step: float, count: int) -> ErrorPropagation:
    """Propagate errors over a run of `count` steps of `step` s, (4), (5)."""
    g = np.zeros((9, 6))
    g[PHI, :3], g[VELOCITY, 3:] = -np.eye(3), np.eye(3)
    whole = np.zeros((15, 15))
    whole[:9, :9], whole[:9, 9:] = f, g
    one = expm(whole * step)
    power, starts, constants = np.eye(15), [], []
    for _ in range(count):
        power = one @ power
        starts.append(power[:9, :9])
        constants.append(power[:9, 9:])
    noises = [
        _noise_covariance(f, part @ part.T, step, starts)
        for part in (g[:, :3], g[:, 3:])
    ]
    return ErrorPropagation(np.array(starts), np.array(constants), noises[0], noises[1])


def _noise_covariance(
    f: Array, density: Array, step: float, powers: list[Array]
) -> Array:
    """Covariance of x at all instants that white noise causes, (9 m, 9 m), (5)."""
    double = np.zeros((18, 18))
    double[:9, :9], double[:9, 9:], double[9:, 9:] = -f, density, f.T
    both = expm(double * step)
    q = both[9:, 9:].T @ both[:9, 9:]  # van Loan
    m = len(powers)
    out, p = np.zeros((m, 9, m, 9)), np.zeros((9, 9))
    for i in range(m):
        p = powers[0] @ p @ powers[0].T + q
        out[i, :, i] = p
        for j in range(i + 1, m):
            out[j, :, i] = powers[j - i - 1] @ p
            out[i, :, j] = out[j, :, i].T
    return out.reshape(9 * m, 9 * m)
