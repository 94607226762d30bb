"""session.toml is wrong about the axes of the device, or about its unit.

The device stands with other axes along those of the procedure than it is said to, its
gyroscopes lie along other axes than its accelerometers of the same names, or it puts
out another unit than the declared one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.earth import STANDARD_GRAVITY
from fieldcal.sim_device.effect import Example, SimulatedEffect, Stage, Word
from fieldcal.sim_device.motion import Installation, mounting_axes

SignedAxes = tuple[tuple[int, int, int], tuple[float, float, float]]
"""Indices of three axes, and their signs."""

UNITS = {
    "g": (1 / STANDARD_GRAVITY, 1.0),
    "mg": (1e3 / STANDARD_GRAVITY, 1.0),
    "deg/s": (1.0, 180 / np.pi),
    "mrad/s": (1.0, 1e3),
}
"""What accelerometers and gyroscopes put out for 1 m/s^2 and 1 rad/s."""


class SimulatedMounting(SimulatedEffect):
    """True axes and unit, which session.toml states wrongly."""

    WORDS = {
        "axes": Word(r"(?:[+-][xyz]){3}", "", "like +x-z+y"),
        "gyr_axes": Word(r"(?:[+-][xyz]){3}", "", "like +y-x+z"),
        "unit": Word("|".join(UNITS), ""),
    }
    ORDER = 5
    EXAMPLE = Example({"axes": "+y-x+z"})

    def change_installation(self, installation: Installation) -> Installation:
        """With other axes, also left-handed ones, if they are given."""
        if not self.words["axes"]:
            return installation
        index, signs = self._signed("axes")
        return replace(installation, axes=index, signs=np.array(signs)[:, None])

    def stage(self, full_scale: Array) -> Stage | None:
        """In the other unit, and gyroscopes along the other axes, if they are given."""
        if not (self.words["unit"] or self.words["gyr_axes"]):
            return None
        acc, gyr = UNITS.get(self.words["unit"], (1.0, 1.0))
        index, signs = self._signed("gyr_axes")

        def put_out(t: Array, x: Array) -> None:
            x[:3] *= acc
            x[3:] = gyr * np.array(signs)[:, None] * x[3:][list(index)]

        return put_out

    def _signed(self, word: str) -> SignedAxes:
        """Axes that a word names, and their signs; as they are where it names none."""
        said = self.words[word] or "+x+y+z"
        names = [said[i : i + 2] for i in (0, 2, 4)]
        return mounting_axes(names, right_handed=False)
