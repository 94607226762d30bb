"""Hand drift: a device that is held by hand also turns slowly.

What `hand_tremor` tells of a window of T s is the rms angle a about a straight line.
The mean rate about an axis has then the variance

    k a^2 / T^2                                                                    (1)

with k = 2 if the hand only trembles about an angle, 15 if its angle is a random walk,
and more if it turns evenly. The accelerometers tell k: about the two axes across
gravity the force turns as the device does. In g its slope s has, of each axis,

    E[s^2] = v + k a^2 / T^2                                                       (2)

with v from their noise. About gravity the hand is taken to turn as much. Five IMUs in
one hand (mikoff, MPU-9150) have k from 23 to 46 by their accelerometers; their
gyroscopes, of which the biases are known from windows without a hand, are off by 33. Of
a board that stands on its faces, k is 2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import detections, priors, tolerances


class ForceTurn(NamedTuple):
    """How the force turns in a window, about each of the two axes across it.

    Attributes
    ----------
    square : mean square of the rate, (rad/s)^2
    noise : the part of it that is noise, (rad/s)^2

    """

    square: float
    noise: float


def force_turn_rate(acc: Array, length: float) -> ForceTurn:
    """How the force turns in a window.

    Parameters
    ----------
    acc : (n, 3) outputs of accelerometers of the same scale, nan where missing
    length : of the window, s

    """
    known = np.isfinite(acc).all(axis=1)
    t = (np.linspace(-0.5, 0.5, len(acc)) * length)[known]
    if len(t) < detections.MIN_SAMPLES:
        return ForceTurn(0.0, np.inf)
    t -= t.mean()
    measured = acc[known]
    mean = measured.mean(axis=0)
    size, off = float(np.linalg.norm(mean)), measured - mean
    slope = t @ off / (t @ t)
    spread = ((off - np.outer(t, slope)) ** 2).sum(axis=0) / (len(t) - 2) / (t @ t)
    across = 1 - (mean / size) ** 2
    slope -= mean * (slope @ mean) / size**2
    return ForceTurn(
        float(slope @ slope) / (2 * size**2), float(spread @ across) / (2 * size**2)
    )


def drift_factor(windows: list[ForceTurn], trembles: Array) -> float:
    """Factor k of (1), at least TREMBLES, estimated from some windows by (2).

    Parameters
    ----------
    windows : k of them
    trembles : (k,) a^2 / T^2 of each, (rad/s)^2

    """
    square, noise = np.array(windows).T
    usable = np.isfinite(noise) & (trembles > 0)
    square, noise, trembles = square[usable], noise[usable], trembles[usable]
    k = priors.WALKING_HAND_K
    for _ in range(tolerances.MAX_ITERATIONS):
        # the square of a normal rate about two axes scatters by itself
        info = 1 / (noise + k * trembles) ** 2
        squares = float(info @ trembles**2)
        product = float(info @ (trembles * (square - noise)))
        k = (product + 1 / priors.WALKING_HAND_K) / (
            squares + 1 / priors.WALKING_HAND_K**2
        )
        k = max(k, priors.STEADY_HAND_K)
    return k
