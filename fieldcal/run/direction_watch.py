"""Whether a device sends the direction of gravity instead of accelerations."""

from __future__ import annotations

from fieldcal.core.samples import ACC, Block
from fieldcal.physics.recording import lsb_of
from fieldcal.run.sample_batches import SampleBatches
from fieldcal.session.direction_alone import direction_alone_text


class DirectionWatch:
    """Tells from samples as they arrive whether they are those of an attitude filter.

    Attributes
    ----------
    notice : sentence about it; empty as long as they seem to be accelerations

    """

    def __init__(self) -> None:
        self._batches = SampleBatches()
        self.notice = ""

    def add(self, block: Block) -> None:
        """Take in the samples that follow; costs nothing once it is noticed."""
        if self.notice or (six := self._batches.add(block)) is None:
            return
        acc = six[:, ACC]
        said = direction_alone_text([acc], max(map(lsb_of, acc.T)))
        if said:
            self.notice = f"{said}; end this (q), and let the device send raw ones"
