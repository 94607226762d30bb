"""Axes of a device in unknown orientations: those of its accelerometers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]


def own_axes(mixed: Array) -> tuple[Array, Array]:
    """What accelerometers see in their own axes, and those axes as rows, (3, 3) each.

    An upper triangle and a rotation whose product a matrix is: x is that of the first
    accelerometer, and there are no k21, k31 and k32. Other axes change scale factors
    by the square of the cross-coupling.
    """
    flipped = np.linalg.qr(mixed[::-1].T)
    turn, upper = flipped[0].T[::-1], flipped[1].T[::-1, ::-1]
    sign = np.sign(np.diag(upper))
    return upper * sign, turn * sign[:, None]
