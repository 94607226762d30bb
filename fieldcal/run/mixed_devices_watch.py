"""Whether the samples that arrive are of two devices by turns."""

from __future__ import annotations

from fieldcal.core.samples import Block
from fieldcal.run.sample_batches import SampleBatches
from fieldcal.session.mixed_devices import GIVE_EACH_A_PORT, mixed_samples_text


class MixedDevicesWatch:
    """Tells from samples as they arrive whether two devices send them.

    Attributes
    ----------
    notice : sentence about it; empty as long as they seem to be of one device

    """

    def __init__(self) -> None:
        self._batches = SampleBatches()
        self.notice = ""

    def add(self, block: Block) -> None:
        """Take in the samples that follow; costs nothing once it is noticed."""
        if self.notice or (six := self._batches.add(block)) is None:
            return
        said = mixed_samples_text(six)
        if said:
            self.notice = f"{said}; end this (q), and {GIVE_EACH_A_PORT}"
