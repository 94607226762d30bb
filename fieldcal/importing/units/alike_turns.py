"""Gyroscopes whose axes all turn alike: each may be of a run of its own.

A rate table turns a device about one axis after the other. Whoever puts the three runs
side by side has rates that one device has about the diagonal of its axes alone.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.importing.units.scales import MIN_ROWS

TOGETHER = 0.99
"""Least correlation of two axes that turn at the same time."""

ALIKE = 0.05
"""Part by which their rates differ: scale factors do by a few hundredths, and hardly
anybody mounts a device so well about its diagonal."""


def tell_alike_turns(block: Block) -> list[str]:
    """Say that all axes turn alike, where no accelerometer tells one device.

    Parameters
    ----------
    block : of the first rows

    """
    if np.isfinite(block.acc).any() or not _turn_alike(block.gyr):
        return []
    return [
        "its three axes turn by the same rate at the same time: one device does so"
        " about the diagonal of its axes alone; if each column is of a run of its own,"
        " import them one by one, such as --columns t,gx,_,_"
    ]


def _turn_alike(gyr: Array) -> bool:
    """Whether rates (n, 3) are those of one turn in each axis, up to their sign."""
    whole = gyr[np.isfinite(gyr).all(axis=1)]
    if len(whole) < MIN_ROWS:
        return False
    spread = whole.std(axis=0)
    if not spread.min() > 0 or np.ptp(spread) > ALIKE * spread.mean():
        return False
    together = np.abs(np.corrcoef(whole.T))
    return bool(together.min() > TOGETHER)
