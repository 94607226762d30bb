"""The team's own way to recalibrate: three positions, driven from Python."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.positions import Position
from fieldcal.core.samples import concat
from fieldcal.drivers.driver import open_driver
from fieldcal.solve import Observations, solve
from fieldcal.windows import Average, average

POSITIONS = [Position.deg(*angles) for angles in ((0, 0), (45, 5), (-45, -5), (45, -5))]
GRAVITY = 9.8111


def recalibrate(
    url: str, turn: Callable[[float, float], float], seconds: float = 10.0
) -> Calibration:
    """Turn the device with `turn`, average in each position, and solve."""
    windows: list[Average] = []
    with open_driver(url) as imu:
        stream = imu.blocks()
        for position in POSITIONS:
            alpha, beta = position.degrees or (0.0, 0.0)
            begin = turn(alpha, beta) + 1.0
            blocks = []
            while not blocks or blocks[-1].t[-1] < begin + seconds:
                blocks.append(next(stream))
            whole = concat(blocks)
            windows.append(average(whole.between(begin, begin + seconds)))
    return solve(Observations.of(POSITIONS, windows, GRAVITY, latitude=np.deg2rad(50)))
