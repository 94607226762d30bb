"""A channel noisier than its like.

    sigma_i = ratio x sigma of the other two axes of the triad

Seen at high frequency, where nothing else is, and in every window: what a hand or an
engine shakes about some axis changes from one to the next. It widens intervals and
shifts nothing.
Source: model of this project; a triad's axes agree within tens of percent.

>>> import numpy as np
>>> noisiest_axis(np.array([1.0, 1.1, 3.0]))
(2, 2.857142857142857)
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import CHANNELS, Array
from fieldcal.physics.effect import Chain, Param
from fieldcal.physics.recording import CheckedSamples, Fault
from fieldcal.windows.noise import short_lag_noise

NOISIER_RATIO = 1.8
"""Ratio from which an axis counts as noisier: out-of-plane axes reach 1.5."""


MIN_WINDOW_SAMPLES = 50
"""Samples of a window that shows the ratio to a tenth."""

STEADY, HALF = 0.8, (1 + NOISIER_RATIO) / 2
"""Share of the windows in which the axis must be the noisiest one, and by what ratio
at least: single windows show it less well."""


def noisiest_axis(noise: Array) -> tuple[int, float]:
    """The noisiest of three axes and its ratio to the mean of the others."""
    worst = int(np.argmax(noise))
    others = np.delete(noise, worst).mean()
    return worst, float(noise[worst] / others) if others > 0 else 1.0


class NoiseLevel(Chain):
    """Noise of one axis beyond that of the others."""

    params = (Param("ratio", "1", 10.0),)
    covariate = "spectrum at high frequency"
    seen_in = "spectrum"
    place = 3
    decided_by = "the axes exchanged: what stays with the axis is the sensor's"
    cure = (
        "Compare with the data sheet; a single axis that is noisier points to a "
        "defect or to vibration along it."
    )
    source = "model of this project"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """The noisier axis of each triad."""
        out = []
        t = recording.block.t
        samples = max(int(recording.still.sum()), 2)
        for first in (0, 3):
            if not np.isfinite(recording.quick[first : first + 3]).all():
                continue
            # what is rounded more coarsely changes seldom, and then by a whole step
            triad = slice(first, first + 3)
            noise = np.maximum(recording.quick[triad], recording.steps[triad])
            if not noise.all():
                continue
            worst, ratio = noisiest_axis(noise)
            if ratio < NOISIER_RATIO or not _is_noisiest_in_most_windows(
                recording, triad, worst
            ):
                continue
            name = CHANNELS[first + worst]
            sigma = ratio * float(np.sqrt(2.0 / samples))
            out.append(
                Fault(
                    channel=name,
                    values={"channel": name, "ratio": ratio},
                    sigmas={"ratio": sigma},
                    from_s=float(t[0]),
                    to_s=float(t[-1]),
                    size=float(noise[worst]),
                    sigma=(ratio - 1) / sigma,
                )
            )
        return out


def _is_noisiest_in_most_windows(
    recording: CheckedSamples, triad: slice, worst: int
) -> bool:
    """Whether an axis of a triad is the noisier one in most windows."""
    found = []
    for first, last in recording.windows:
        noise = short_lag_noise(recording.six(first, last)[:, triad])
        noise = np.maximum(noise, recording.grids.within(first, last)[triad])
        if last - first > MIN_WINDOW_SAMPLES and np.isfinite(noise).all():
            axis, ratio = noisiest_axis(noise)
            found.append(axis == worst and ratio > HALF)
    return not found or float(np.mean(found)) >= STEADY
