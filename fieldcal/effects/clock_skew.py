"""The device's clock runs fast (positive) or slow against the host's.

    t = t0 + (1 + 1e-6 ppm) (t_host - t_host0)

Arrival only ever comes late, so the line is laid through the earliest arrival of each
stretch. Source: V. Paxson, On Calibrating Measurements of Packet Transit Times, 1998.

>>> import numpy as np
>>> host = np.arange(0.0, 100.0, 0.01)
>>> round(estimate_skew(host * (1 + 2e-4), host)[0], 3)
200.0
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import Chain, Param
from fieldcal.physics.recording import CheckedSamples, Fault

STRETCHES = 60
PPM = 5.0
"""Smallest rate that is reported: crystals differ by as much."""

WORST = 1e5
"""Largest rate of a crystal, ppm: a larger one is a recording at another speed."""

MIN_SIGMAS = 6.0


def estimate_skew(t: Array, t_host: Array) -> tuple[float, float]:
    """Estimate the rate of the device's clock against the host's, and its ±, ppm."""
    late = (t_host - t_host[0]) - (t - t[0])
    parts = np.array_split(np.arange(len(t)), min(STRETCHES, max(len(t) // 20, 2)))
    first = np.array([p[np.argmin(late[p])] for p in parts])
    x, y = t[first] - t[first].mean(), late[first]
    spread = float(x @ x)
    slope = float(x @ y) / spread
    rest = y - y.mean() - slope * x
    # neighbouring stretches share what the host was busy with: count one in three
    error = np.sqrt(float(rest @ rest) / max(len(x) - 2, 1) / spread * 3)
    # late grows by slope per device second: t_host = (1 + slope) t
    return -1e6 * slope / (1 + slope), 1e6 * float(error)


class ClockSkew(Chain):
    """Rate error of the device's clock against the host's."""

    params = (Param("ppm", "ppm", 2000.0),)
    covariate = "t against t_host"
    place = 2
    decided_by = "a longer recording, and a host clock kept by a time server"
    cure = (
        "Use the host's times over long stretches, or correct the rate by the "
        "ppm that were found."
    )
    source = "Paxson 1998; 10 to 2000 ppm"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """Estimate the rate of the clock from the host's times, if there are any."""
        block = recording.block
        known = np.isfinite(block.t_host)
        if known.sum() < 100:
            return []
        ppm, sigma = estimate_skew(block.t[known], block.t_host[known])
        if not max(PPM, MIN_SIGMAS * sigma) <= abs(ppm) <= WORST:
            return []
        return [
            Fault(
                channel="t",
                values={"ppm": ppm},
                sigmas={"ppm": sigma},
                from_s=float(block.t[0]),
                to_s=float(block.t[-1]),
                size=ppm,
                sigma=abs(ppm) / max(sigma, 1e-9),
            )
        ]
