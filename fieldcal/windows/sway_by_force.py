"""Swaying of a device without gyroscopes, by its accelerometers alone.

With the force f0 at rest, small turns phi about level axes change the force by f0 x phi
and the accelerometers across it show

    phi = -f0 x (f - f0) / f0^2                                                    (1)

A linear oscillation looks the same: a ship surges as it rolls. Both are waves and are
subtracted in the same way. Only their terms of second order differ: their mean is
phi^2 / 2 of gravity if the base turns about a centre near the device, and zero if it
moves linearly. The value for a rotation is used, with an uncertainty of the same size.

Source: rotation kinematics to second order.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.windows.sway_waves import SwayWaves


def lean_angles(y: Array, force: Array) -> Array:
    """Angles phi (m, 3) from forces (m, 3) by (1), rad, with zero mean."""
    angle: Array = -np.cross(force, y - y.mean(axis=0)) / float(force @ force)
    return angle


def with_turn_rates(waves: SwayWaves) -> SwayWaves:
    """Waves (k, 3) of accelerometers, extended by those of gyroscopes, (k, 6).

    The rates follow from (1): phi = c cos wt + s sin wt has the derivative
    w s cos wt - w c sin wt.
    """
    force, pulse = waves.force, 2 * np.pi * waves.hz[:, None]
    cos, sin = (
        -np.cross(force, part) / float(force @ force) for part in (waves.cos, waves.sin)
    )
    return replace(
        waves,
        cos=np.hstack([waves.cos, pulse * sin]),
        sin=np.hstack([waves.sin, -pulse * cos]),
        excess_variance=np.concatenate([waves.excess_variance, np.zeros(3)]),
        noise=np.concatenate([waves.noise, np.full(3, np.nan)]),
    )
