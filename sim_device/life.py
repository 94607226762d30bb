"""What the sensors of the device live through, instant by instant."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcal.core.samples import Array


@dataclass(frozen=True, slots=True)
class Life:
    """What the device lives through at n instants.

    Attributes
    ----------
    t : (n,) s since it was switched on
    f, w : (3, n) true specific force and angular rate, device axes
    warmth : (n,) temperature less that at the start, K
    warming : (n,) rate of the temperature, K/s
    since : (n,) s since the last turn ended, negative in a turn, inf before any
    progress : (n,) share of the last turn that has passed
    vibration : (3, n) vibration about `f`, m/s^2

    """

    t: Array
    f: Array
    w: Array
    warmth: Array
    warming: Array
    since: Array
    progress: Array
    vibration: Array
