"""What a device measures otherwise that is held turned by a small angle."""

from __future__ import annotations

import numpy as np

from fieldcal.core.rotation import rotation_matrices
from fieldcal.core.samples import Array


def change_by_turn(f: Array, w: Array, turn: Array) -> Array:
    """Change of force and rate in axes that are turned by rotation vectors, (n, 6).

    Parameters
    ----------
    f, w : (n, 3) m/s^2 and rad/s, in the axes before the turn
    turn : (n, 3) rad

    >>> f, w = np.array([[0.0, -9.81, 0.0]]), np.zeros((1, 3))
    >>> np.round(change_by_turn(f, w, np.array([[0.0, 0.0, 0.02]])), 4)[0, :3]
    array([-0.1962,  0.002 ,  0.    ])
    """
    matrix = np.swapaxes(rotation_matrices(turn), -1, -2)
    out: Array = np.hstack([(matrix @ v[:, :, None])[:, :, 0] - v for v in (f, w)])
    return out
