"""Inputs of the device's sensors at each instant: motion, temperature, vibration."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcal.core.samples import Array


@dataclass(frozen=True, slots=True)
class SensorConditions:
    """Inputs of the sensors at n instants.

    Attributes
    ----------
    t : (n,) s since it was switched on
    f, w : (3, n) true specific force and angular rate, device axes
    temperature_rise : (n,) temperature less that at the start, K
    temperature_rate : (n,) rate of the temperature, K/s
    since_turn : (n,) s since the last turn ended, negative in a turn, inf before any
    turn_progress : (n,) share of the last turn that has passed
    vibration : (3, n) vibration about `f`, m/s^2

    """

    t: Array
    f: Array
    w: Array
    temperature_rise: Array
    temperature_rate: Array
    since_turn: Array
    turn_progress: Array
    vibration: Array
