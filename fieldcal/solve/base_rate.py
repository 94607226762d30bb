"""The rate of the base: the Earth's, and that of a base under way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.base_motion import BaseMotion
from fieldcal.core.frames import EARTH_RATE, earth_rate_at_home
from fieldcal.core.samples import Array
from fieldcal.model.rows.averages import Rows


def known_earth_rate(
    latitude: float | None,
    navigation: bool,
    heading: float | None,
    base_motion: BaseMotion | None = None,
) -> tuple[Array, tuple[float, float, float]]:
    """The Earth's rate in base axes, and its uncertainty, rad/s.

    The vertical part follows from the latitude, the level part from the uncertainty of
    the heading, rad, with z pointing north. If no heading is stated, z may point
    anywhere for tactical grade, and points exactly north for navigation grade.
    """
    if latitude is None:
        free = EARTH_RATE / float(np.sqrt(3.0))
        return np.zeros(3), (free, free, free)
    moving = base_motion or BaseMotion()
    home = earth_rate_at_home(latitude) + moving.rate
    level = float(np.hypot(home[0], home[2]))
    if navigation and heading is None:
        heading = 0.0
    if heading is not None:
        return home, (abs(home[2]) * heading, 0.0, abs(home[0]) * heading)
    anywhere = level / float(np.sqrt(2.0))
    return home * [0.0, 1.0, 0.0], (anywhere, 0.0, anywhere)


def with_base_rate(rows: Rows, base_rate: Array) -> Rows:
    """The rows with the rate of the base, (3,) rad/s."""
    return replace(rows, x=rows.x.turned(base_rate=base_rate))
