"""Rounding to a step that matters against the noise.

    U = lsb round(U / lsb)

With noise above half a step, rounding only adds lsb^2/12 to the variance of a sample.
Below that the mean of a window itself is off, by up to

    (lsb / pi) exp(-2 pi^2 (noise / lsb)^2)

which longer averaging does not mend; `fieldcal.windows.rounding` has the whole of it.
Source: B. Widrow, I. Kollar, Quantization Noise, chapter 4.

>>> import numpy as np
>>> sampled = np.hypot(0.3, rounding.least_deviation(np.array([1.0])))
>>> np.sqrt(2 * rounding.variance_of_mean(np.array([1.0]), sampled)).round(4)
array([0.0539])
"""

from __future__ import annotations

from fieldcal.core.samples import CHANNELS
from fieldcal.physics.effect import Chain, Param
from fieldcal.physics.recording import CheckedSamples, Fault
from fieldcal.windows import rounding

MATTERS = 0.5
"""Noise in steps from which rounding is no matter: LSB > 2 sigma is far beyond it."""


class Quantisation(Chain):
    """Rounding of the outputs."""

    params = (Param("acc", "m/s^2", 1.0), Param("gyr", "rad/s", 0.1))
    covariate = "few distinct values"
    decided_by = "a smaller range, or a finer output format"
    cure = "Choose a smaller range, or an output with more digits."
    source = "Widrow and Kollar, Quantization Noise"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """The step of each triad, where it is coarse against the noise."""
        out = []
        t, whole = recording.block.t, len(recording.block)
        for part, channels in (("acc", (0, 1, 2)), ("gyr", (3, 4, 5))):
            coarse = [
                (step, c, first, last)
                for c in channels
                for first, last, step in recording.grids.stretches(c, whole)
                if self._matters(recording, c, step)
            ]
            if coarse:
                lsb, worst, first, last = max(coarse)
                out.append(
                    Fault(
                        channel=CHANNELS[worst],
                        values={part: lsb},
                        sigmas={part: 1e-3 * lsb},
                        from_s=float(t[first]),
                        to_s=float(t[last - 1]),
                        size=lsb,
                        sigma=lsb / max(float(recording.noise[worst]), 1e-12),
                    )
                )
        return out

    def _matters(self, recording: CheckedSamples, c: int, lsb: float) -> bool:
        finest = recording.grids.steps[:, c].min()
        own = rounding.noise_before_rounding(recording.noise[c], finest)
        return bool(lsb > 2 * MATTERS * own)
