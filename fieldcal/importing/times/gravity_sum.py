"""Accelerations without gravity, and gravity: together what the sensors measured.

Telephones part the specific force f into the acceleration a of their case and gravity
g, in device axes: f = a + g. Each sample of a goes with the nearest of g in time;
nothing is interpolated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.importing.times.alignment import AlignedPair

AT_REST = 0.1
"""Share of the rows in which a device that is calibrated is still at least."""

NO_GRAVITY = 0.05
"""Part of gravity below which accelerations at rest lack it: in another unit, g in
place of m/s^2, they read a tenth."""


def lacks_gravity(acc: Array, gravity: Array) -> bool:
    """Whether accelerations (n, 3) read nothing at rest, where gravity is (m, 3).

    >>> lacks_gravity(np.full((9, 3), 0.02), np.full((9, 3), 5.7))
    True
    """
    sizes, down = (np.linalg.norm(x, axis=1) for x in (acc, gravity))
    sizes, down = sizes[np.isfinite(sizes)], down[np.isfinite(down)]
    if not (len(sizes) and len(down)):
        return False
    return bool(np.quantile(sizes, AT_REST) < NO_GRAVITY * np.median(down))


class GravitySum:
    """Adds gravity to accelerations that lack it.

    Attributes
    ----------
    lacking : samples near which there is no gravity, left out

    """

    def __init__(self) -> None:
        self._pair = AlignedPair()
        self._rows = self.lacking = 0

    def through(
        self, acc: Iterable[Block], gravity: Iterable[Block]
    ) -> Iterator[Block]:
        """Samples of the accelerometer with gravity, all with a time."""
        beside = (Block.of(b.t, np.full(b.acc.shape, np.nan), b.acc) for b in gravity)
        for block in self._pair.through(acc, beside):
            near = np.isfinite(block.gyr).all(axis=1)
            self._rows += len(block)
            self.lacking += int((~near).sum())
            some = block[np.flatnonzero(near)]
            yield Block.of(some.t, some.acc + some.gyr, None, some.temperature)

    @property
    def none(self) -> bool:
        """Whether no sample had gravity near it."""
        return self.lacking == self._rows

    def sentence(self) -> str:
        """Say what was done."""
        text = (
            "its accelerations lack gravity, which a file of its own holds: the two are"
            f" added, each with the nearest, {1e3 * self._pair.worst:.2g} ms apart at"
            " most"
        )
        if self.lacking:
            text += f"; {self.lacking} without gravity near them are left out"
        return text
