"""The temperature that the sensors have, and how fast it changes.

    T(t)  = air(t) + H (1 - exp(-t / tau))                          (t1)
    T'(t) = air'(t) + H exp(-t / tau) / tau                         (t2)

air(t) is a ramp or linear between given points; H is the rise by the device's own
power. A recorded temperature may stand in for all of it. T in °C, t in s since the
device was switched on; before that nothing changes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.profile import Climate

SMOOTHED_S = 5.0
"""A recorded temperature is averaged over so long: sensors do not follow its noise."""


def temperature_course(climate: Climate, t: Array) -> tuple[Array, Array]:
    """Temperature (n,) °C and its rate (n,) K/s at instants `t`, (n,) s."""
    t = np.maximum(t, 0.0)
    if climate.points:
        when, degrees = np.array(climate.points).T
        air = np.interp(t, when, degrees)
        rate = _slope(when, degrees, t)
    else:
        air = climate.ambient_c + climate.ramp_k_s * t
        rate = climate.ramp_k_s + np.zeros_like(t)
    left = climate.self_heating_k * np.exp(-t / climate.warm_up_s)
    return (
        air + climate.self_heating_k - left,  # (t1)
        rate + left / climate.warm_up_s,  # (t2)
    )


def recorded_climate(climate: Climate, t: Array, degrees: Array) -> Climate:
    """Climate in which the device has the temperatures of a recording.

    Parameters
    ----------
    climate : what is not known from the recording
    t : (n,) s, ascending
    degrees : (n,) °C, nan where unknown

    """
    known = np.isfinite(degrees)
    if not known.any():
        return climate
    slot = np.floor(t[known] / SMOOTHED_S).astype(int)
    _, at = np.unique(slot, return_inverse=True)
    count = np.bincount(at)
    when = np.bincount(at, t[known]) / count
    mean = np.bincount(at, degrees[known]) / count
    points = tuple(zip(when.tolist(), mean.tolist(), strict=True))
    return replace(climate, points=points, self_heating_k=0.0)


def _slope(when: Array, degrees: Array, t: Array) -> Array:
    if len(when) < 2:
        return np.zeros_like(t)
    slopes = np.concatenate([[0.0], np.diff(degrees) / np.diff(when), [0.0]])
    steepness: Array = slopes[np.searchsorted(when, t, side="right")]
    return steepness
