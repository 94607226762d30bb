"""The Earth's rate in windows, as far as it is known.

At rest in a known position it is A w_base, the vertical part by the latitude phi, the
level part by the heading psi, or unknown:

    w_base = Omega (cos phi sin psi, -sin phi, cos phi cos psi)                     (1)

What is not known of it is (n, 3, k): columns of factors of mean 0 and variance 1. On a
rate table that turns about the axis n, what lies across goes round and averages out, up
to what the last turn leaves, which is part of the window's own error; so there it is

    n n^T A w_base                                                                  (2)

Device axes, rad/s. Source: Avrutov and Pozniak 2023, (39); (2) is of this project.
"""

from __future__ import annotations

import numpy as np

from fieldcal.frames import EARTH_RATE, earth_rate_home, lasting
from fieldcal.samples import Array
from fieldcal.solve.observations import ACC, Observations
from fieldcal.solve.tilt import Base


def earth_rate(
    observations: Observations, heading_sigma: float | None, base: Base
) -> tuple[Array, Array]:
    """Part of the Earth's rate that is known, (n, 3), and columns of the rest.

    Parameters
    ----------
    observations : n positions
    heading_sigma : how well z points north, rad; None where it points anywhere
    base : how it is tilted

    """
    phi = observations.latitude
    if phi is None or not observations.oriented.all():
        known, unknown = _unoriented(observations)
    else:
        known, unknown = _oriented(observations, phi, heading_sigma, base)
    left = lasting(observations.rates)  # (2)
    return (left @ known[..., None])[..., 0], left @ unknown


def _oriented(
    observations: Observations, phi: float, heading_sigma: float | None, base: Base
) -> tuple[Array, Array]:
    places, mounting = observations.positions, observations.mounting
    east, _, north = (
        base.seen(EARTH_RATE * np.cos(phi) * axis, places, mounting)[0]
        for axis in np.eye(3)
    )
    if heading_sigma is None:
        home: Array = earth_rate_home(phi) * [0.0, 1.0, 0.0]
        level = [east * np.sqrt(0.5), north * np.sqrt(0.5)]
    else:
        home = earth_rate_home(phi)
        level = [east * heading_sigma]
    known, by_tilt = base.seen(home, places, mounting)
    return known, np.concatenate([np.stack(level, axis=-1), by_tilt], axis=-1)


def _unoriented(observations: Observations) -> tuple[Array, Array]:
    """Earth's rate where only up is known, from the accelerometers, or not even that.

    Each position then has a heading of its own, independent of the others.
    """
    n = len(observations)
    known = np.zeros((n, 3))
    spread = np.tile(np.eye(3) * EARTH_RATE / np.sqrt(3), (n, 1, 1))
    phi = observations.latitude
    seen = np.isfinite(observations.mean[:, ACC]).all(axis=1) & ~observations.rotating
    if phi is not None and seen.any():
        nominal = observations.nominal
        up = (observations.mean[seen, ACC] - nominal.acc_bias) / nominal.acc_scale
        up /= np.linalg.norm(up, axis=1, keepdims=True)
        known[seen] = EARTH_RATE * np.sin(phi) * up
        level = np.eye(3) - up[:, :, None] * up[:, None, :]
        spread[seen] = level * EARTH_RATE * np.cos(phi) * np.sqrt(0.5)
    unknown = np.zeros((n, 3, n, 3))
    unknown[np.arange(n), :, np.arange(n)] = spread
    return known, unknown.reshape(n, 3, 3 * n)


def printed_earth_rate(observations: Observations) -> Array:
    """Reference (40), (41) as printed, in procedure axes, (n, 3) rad/s; not for use."""
    a, b = observations.angles
    up, north = (EARTH_RATE * f(observations.known_latitude) for f in (np.sin, np.cos))
    third = -up * np.sin(a) * np.sin(b) + north * np.cos(b)  # (41), sin for cos alpha
    third = np.where((a == 0) & (b == 0), -up, third)  # (40)
    second = up * np.cos(a) * np.cos(b) + north * np.sin(b)
    return np.stack([up * np.sin(a), second, third], axis=1)
