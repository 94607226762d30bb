"""The gyroscopes feel the rotation of the Earth.

The noise of a tactical device hides it, and the plain simulation leaves it out; there
it is an effect like others. A device of navigation grade always feels it.
"""

from __future__ import annotations

from fieldcal.sim_device.effect import Example, SimulatedEffect


class SimulatedEarthRate(SimulatedEffect):
    """Rotation of the Earth, which the gyroscopes measure."""

    REPEATS = True
    FEELS_EARTH = True
    EXAMPLE = Example({}, device={"noise": {"gyr": [2e-5, 2e-5, 2e-5]}})
