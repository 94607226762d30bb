"""Whether a device sends the direction of gravity instead of accelerations."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.physics.recording import lsb_of
from fieldcal.session.direction_alone import direction_alone_text

LOOKED_AT = 200
"""Samples that are looked at together."""


class DirectionWatch:
    """Tells from samples as they arrive whether they are those of an attitude filter.

    Attributes
    ----------
    notice : sentence about it; empty as long as they seem to be accelerations

    """

    def __init__(self) -> None:
        self._kept: list[Array] = []
        self._count = 0
        self.notice = ""

    def add(self, block: Block) -> None:
        """Take in the samples that follow; costs nothing once it is noticed."""
        if self.notice:
            return
        self._kept.append(block.acc)
        self._count += len(block.t)
        if self._count < LOOKED_AT:
            return
        acc = np.vstack(self._kept)
        self._kept, self._count = [], 0
        said = direction_alone_text([acc], max(map(lsb_of, acc.T)))
        if said:
            self.notice = f"{said}; end this (q), and let the device send raw ones"
