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

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.physics.effect import Chain, Param
from fieldcal.physics.recording import MIN_GRID_VALUES, CheckedSamples, Fault
from fieldcal.windows import rounding

MATTERS = 0.5
"""Noise in steps from which rounding is no matter: LSB > 2 sigma is far beyond it."""

WELL_KNOWN = 1e-3
"""Least standard deviation of a step, of its size."""


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
                block = recording.block[first:last]
                shown = block.acc if part == "acc" else block.gyr
                out.append(
                    Fault(
                        channel=CHANNELS[worst],
                        values={part: lsb},
                        sigmas={part: step_deviation(shown, worst % 3, lsb)},
                        from_s=float(t[first]),
                        to_s=float(t[last - 1]),
                        size=lsb,
                        sigma=lsb / max(float(recording.noise[worst]), 1e-12),
                    )
                )
        return out

    def _matters(self, recording: CheckedSamples, c: int, lsb: float) -> bool:
        finest = recording.grids.steps[:, c].min()
        # beside a hand, samples differ from the next by what the sensor is alone
        shown = min(recording.noise[c], recording.quick[c])
        own = rounding.noise_before_rounding(shown, finest)
        return bool(lsb > 2 * MATTERS * own)


def step_deviation(triad: Array, axis: int, lsb: float) -> float:
    """Standard deviation of the step of an axis, by how its values depart from it.

    A log with few digits rounds what lay on the grid of the device once more. An axis
    that shows few values has the step of the others, so theirs count too.

    >>> values = np.array([[0.0020, 0.9995, 0.0], [0.0024, 1.0, 0.0]])
    >>> round(step_deviation(values, 0, 4e-4), 6)
    7.1e-05
    """
    shown = [np.unique(one[np.isfinite(one)]) for one in triad.T]
    few = len(shown[axis]) < MIN_GRID_VALUES
    alike = [v for v in shown if len(v) < MIN_GRID_VALUES] if few else [shown[axis]]
    gaps = np.concatenate([np.diff(values) for values in alike])
    steps = np.round(gaps / lsb)
    if not steps.any():
        return WELL_KNOWN * lsb
    departs = np.sqrt(np.mean((gaps - steps * lsb)[steps > 0] ** 2))
    span = max(steps.sum() / len(alike), 1.0)
    return max(WELL_KNOWN * lsb, float(departs / span))
