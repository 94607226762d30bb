"""The place of a recording: latitude, height, gravity and velocity of the base."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.base_motion import BaseMotion
from fieldcal.core.errors import InputError
from fieldcal.core.gravity import normal_gravity

MIDDLE_LATITUDE_DEG = 45.0
"""Latitude whose gravity is taken if neither latitude nor gravity is stated: gravity
there is in the middle of its range on Earth."""


@dataclass(frozen=True, slots=True)
class Site:
    """Place and velocity of the base.

    Attributes
    ----------
    latitude_deg : None if it is not stated
    height_m : above the ellipsoid; 0 if it is not stated
    gravity : m/s^2, less the vertical part of the force of a moving base
    motion : rate and force of a base that moves

    """

    latitude_deg: float | None
    height_m: float
    gravity: float
    motion: BaseMotion

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Site:
        """Read the table [site].

        Raises
        ------
        InputError
            If a velocity is stated without a latitude, or no place on Earth.

        """
        stated = table.get("latitude_deg")
        latitude = None if stated is None else float(stated)
        height = float(table.get("height_m", 0.0))
        motion = _motion(velocity(table), latitude, height)
        usual = normal_gravity(
            MIDDLE_LATITUDE_DEG if latitude is None else latitude, height
        )
        gravity = float(table.get("gravity") or usual) - float(motion.force[1])
        return cls(latitude, height, gravity, motion)


def velocity(table: Mapping[str, Any]) -> tuple[float, float]:
    """Velocity towards north and east that the table [site] states, m/s."""
    return float(table.get("north_m_s", 0.0)), float(table.get("east_m_s", 0.0))


def _motion(
    moving: tuple[float, float], latitude: float | None, height: float
) -> BaseMotion:
    if not any(moving):
        return BaseMotion()
    if latitude is None:
        raise InputError(
            "[site] states a velocity, and no latitude_deg, on which the Coriolis force"
            " and the rate of a moving base depend: state latitude_deg"
        )
    return BaseMotion.from_velocity(*moving, float(np.deg2rad(latitude)), height)
