"""What happens to samples between the sensors and the wire.

They are clipped at the device's full scale, pass what its effects do to them, in their
order, and some may not arrive. Outputs (6, n) in m/s^2 and rad/s.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.random_process import random_stream


class SignalChain:
    """Signal chain of one device, with the state of its stages."""

    def __init__(self, profile: Profile, seed: int) -> None:
        limits = (profile.range.acceleration, profile.range.angular_rate)
        full = [np.inf if limit is None else limit for limit in limits]
        self._full_scale: Array = np.repeat(full, 3)
        stages = (e.stage(self._full_scale) for e in profile.in_order)
        self._stages = [stage for stage in stages if stage is not None]
        arrivals = (e.arrival(random_stream(seed, e.id)) for e in profile.effects)
        self._arrivals = [arrival for arrival in arrivals if arrival is not None]

    def passes(self, t: Array, outputs: Array) -> Array:
        """What comes out of the chain for `outputs` (6, n) at `t` (n,) s."""
        full = self._full_scale[:, None]
        x: Array = np.clip(outputs, -full, full)
        for stage in self._stages:
            stage(t, x)
        return x

    def arrives(self, n: int) -> NDArray[np.bool_]:
        """Which of the next `n` samples are not dropped, (n,) bool."""
        kept = np.ones(n, dtype=np.bool_)
        for arrival in self._arrivals:
            kept &= arrival(n)
        return kept
