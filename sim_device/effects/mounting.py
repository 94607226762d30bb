"""session.toml is wrong about the axes of the device, or about its unit.

The device stands with other axes along those of the procedure than it is said to, or
puts out another unit than the declared one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.earth import STANDARD_GRAVITY
from fieldcal.sim_device.effect import Example, SimulatedEffect, Stage, Word
from fieldcal.sim_device.motion import Stand, mounting_axes

UNITS = {
    "g": (1 / STANDARD_GRAVITY, 1.0),
    "mg": (1e3 / STANDARD_GRAVITY, 1.0),
    "deg/s": (1.0, 180 / np.pi),
    "mrad/s": (1.0, 1e3),
}
"""What accelerometers and gyroscopes put out for 1 m/s^2 and 1 rad/s."""


class SimulatedMounting(SimulatedEffect):
    """Axes and unit as they are."""

    WORDS = {
        "axes": Word(r"(?:[+-][xyz]){3}", "", "like +x-z+y"),
        "unit": Word("|".join(UNITS), ""),
    }
    ORDER = 5
    EXAMPLE = Example({"axes": "+y-x+z"})

    def stands(self, stand: Stand) -> Stand:
        """With other axes, also left-handed ones, if they are given."""
        wrong = self.words["axes"]
        if not wrong:
            return stand
        names = [wrong[i : i + 2] for i in (0, 2, 4)]
        index, signs = mounting_axes(names, right_handed=False)
        return replace(stand, axes=index, signs=np.array(signs)[:, None])

    def stage(self, full_scale: Array) -> Stage | None:
        """In the other unit, if it is given."""
        if not self.words["unit"]:
            return None
        acc, gyr = UNITS[self.words["unit"]]

        def put_out(t: Array, x: Array) -> None:
            x[:3] *= acc
            x[3:] *= gyr

        return put_out
