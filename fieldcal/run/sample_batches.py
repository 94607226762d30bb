"""Samples of a run gathered until there are enough of them to judge."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block

LOOKED_AT = 200
"""Samples that are looked at together."""


class SampleBatches:
    """Gathers samples as they arrive, and hands them on `LOOKED_AT` or more at once."""

    def __init__(self) -> None:
        self._kept: list[Array] = []
        self._count = 0

    def add(self, block: Block) -> Array | None:
        """The samples (n, 6) since the last batch if they are enough; else None."""
        self._kept.append(block.six)
        self._count += len(block.t)
        if self._count < LOOKED_AT:
            return None
        batch = np.vstack(self._kept)
        self._kept, self._count = [], 0
        return batch
