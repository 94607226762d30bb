"""Whether the samples that arrive are of two devices by turns."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.session.mixed_devices import GIVE_EACH_A_PORT, mixed_samples_text

LOOKED_AT = 200
"""Samples that are looked at together."""


class MixedDevicesWatch:
    """Tells from samples as they arrive whether two devices send them.

    Attributes
    ----------
    notice : sentence about it; empty as long as they seem to be of one device

    """

    def __init__(self) -> None:
        self._kept: list[Array] = []
        self._count = 0
        self.notice = ""

    def add(self, block: Block) -> None:
        """Take in the samples that follow; costs nothing once it is noticed."""
        if self.notice:
            return
        self._kept.append(block.six)
        self._count += len(block.t)
        if self._count < LOOKED_AT:
            return
        said = mixed_samples_text(np.vstack(self._kept))
        self._kept, self._count = [], 0
        if said:
            self.notice = f"{said}; end this (q), and {GIVE_EACH_A_PORT}"
