"""Gravity and rotation of the Earth where the device stands.

Normal gravity of the ellipsoid in closed form, at any height, from its potential in
ellipsoidal coordinates u (semi-minor axis of the confocal ellipsoid through the place)
and b (reduced latitude); E is the linear eccentricity, G the gravitational constant
times the mass, O the rate of rotation:

    g_u = -(G + O^2 a^2 E (q'/q0) (sin^2 b / 2 - 1/6)) / (w (u^2 + E^2))
          + O^2 u cos^2 b / w                                       (e1)
    g_b = (O^2 a^2 (q/q0) / sqrt(u^2 + E^2) - O^2 sqrt(u^2 + E^2)) sin b cos b / w  (e2)
    w   = sqrt((u^2 + E^2 sin^2 b) / (u^2 + E^2))                   (e3)
    q   = ((1 + 3 u^2/E^2) atan(E/u) - 3 u/E) / 2                   (e4)
    q'  = 3 (1 + u^2/E^2) (1 - (u/E) atan(E/u)) - 1                 (e5)

Units m, s. Source: Heiskanen and Moritz, Physical Geodesy (1967), section 2-8; WGS84.
"""

from __future__ import annotations

from math import atan, atan2, cos, hypot, radians, sin, sqrt

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array

RATE = 7.292115e-5
"""Angular rate of the Earth, rad/s."""

STANDARD_GRAVITY = 9.80665
"""What a device means by one g, m/s^2."""

STEP_S = 2.0
"""Step of differences along a path over the Earth, s."""

_SEMI_MAJOR = 6_378_137.0
_SEMI_MINOR = _SEMI_MAJOR * (1 - 1 / 298.257223563)
_GM = 3.986004418e14
_E = sqrt(_SEMI_MAJOR**2 - _SEMI_MINOR**2)


def gravity(latitude_deg: float, height_m: float) -> float:
    """Magnitude of normal gravity, m/s^2, at geodetic latitude and height.

    Raises
    ------
    InputError
        If there is no such place for a device.

    >>> round(gravity(45.0, 0.0), 5)
    9.8062
    """
    if not -90 <= latitude_deg <= 90 or not -1000 <= height_m <= 100_000:
        raise InputError(
            f"the device cannot stand at latitude {latitude_deg:g}°, height "
            f"{height_m:g} m: latitude is -90 to 90°, height -1000 to 100000 m"
        )
    u, b = _ellipsoidal(radians(latitude_deg), height_m)
    square = u * u + _E * _E
    centrifugal = (RATE * _SEMI_MAJOR) ** 2
    w = sqrt((u * u + (_E * sin(b)) ** 2) / square)  # (e3)
    q0 = _q(_SEMI_MINOR)
    q_prime = 3 * (1 + (u / _E) ** 2) * (1 - u / _E * atan(_E / u)) - 1  # (e5)
    flattening = centrifugal * _E * q_prime / q0 * (sin(b) ** 2 / 2 - 1 / 6)
    g_u = (-(_GM + flattening) / square + RATE**2 * u * cos(b) ** 2) / w  # (e1)
    g_b = (centrifugal * _q(u) / q0 / sqrt(square) - RATE**2 * sqrt(square)) / w
    return hypot(g_u, g_b * sin(b) * cos(b))  # (e2)


def moving_base_terms(
    latitude: float, height_m: float, north: float, east: float
) -> tuple[Array, Array]:
    """What a base that moves over the Earth adds, by the path of a point in space.

    Parameters
    ----------
    latitude : rad
    height_m : m
    north, east : m/s

    Returns
    -------
    rate : (3, 1) rad/s of the local level (East, down, north), beside the Earth's
    pull : (3, 1) m/s^2, acceleration of the point less that of one that stands

    """
    (moved, turned), (stood, spun) = (
        _moving_base_terms_at(latitude, height_m, *v)
        for v in ((north, east), (0.0, 0.0))
    )
    return (turned - spun)[:, None], (moved - stood)[:, None]


def _moving_base_terms_at(
    latitude: float, height: float, north: float, east: float
) -> tuple[Array, Array]:
    """Acceleration and rate of the local level, by differences, level axes, (3,)."""
    places, axes = [], []
    for way in (-STEP_S, 0.0, STEP_S):
        half = latitude + north * way / 2 / (_radii(latitude)[1] + height)
        phi = latitude + north * way / (_radii(half)[1] + height)
        circle = (_radii(half)[0] + height) * cos(half)
        turned = RATE * way + east * way / circle
        out = _radii(phi)[0]
        ratio = (_SEMI_MINOR / _SEMI_MAJOR) ** 2
        level, up = (out + height) * cos(phi), (out * ratio + height) * sin(phi)
        places.append([level * cos(turned), level * sin(turned), up])
        axes.append(
            [
                [-sin(turned), cos(turned), 0.0],
                [-cos(phi) * cos(turned), -cos(phi) * sin(turned), -sin(phi)],
                [-sin(phi) * cos(turned), -sin(phi) * sin(turned), cos(phi)],
            ]
        )
    before, now, after = (np.array(p) for p in places)
    first, middle, last = (np.array(a) for a in axes)
    change = (last - first) / (2 * STEP_S) @ middle.T  # of axes: -[w]x
    rate = np.array([change[1, 2], change[2, 0], change[0, 1]])
    return middle @ (after - 2 * now + before) / STEP_S**2, rate


def _radii(latitude: float) -> tuple[float, float]:
    """Radii of curvature of the prime vertical and of the meridian, m."""
    root = hypot(_SEMI_MAJOR * cos(latitude), _SEMI_MINOR * sin(latitude))
    return _SEMI_MAJOR**2 / root, (_SEMI_MAJOR * _SEMI_MINOR) ** 2 / root**3


def _ellipsoidal(latitude: float, height: float) -> tuple[float, float]:
    """Coordinates u in m and reduced latitude in rad of a geodetic place."""
    radius = _SEMI_MAJOR**2 / hypot(
        _SEMI_MAJOR * cos(latitude), _SEMI_MINOR * sin(latitude)
    )
    out = (radius + height) * cos(latitude)
    up = (radius * (_SEMI_MINOR / _SEMI_MAJOR) ** 2 + height) * sin(latitude)
    excess = out * out + up * up - _E * _E
    u = sqrt(excess / 2 * (1 + sqrt(1 + (2 * _E * up / excess) ** 2)))
    return u, atan2(up * sqrt(u * u + _E * _E), u * out)


def _q(u: float) -> float:
    return ((1 + 3 * (u / _E) ** 2) * atan(_E / u) - 3 * u / _E) / 2  # (e4)
