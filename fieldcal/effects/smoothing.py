"""A program smoothed the outputs before they were recorded.

    y_n = k y_(n-1) + (1 - k) x_n,    tau = -interval / ln k

x outputs of the device and y the recorded ones, of sample n: an exponential moving
average, or low-pass of first order. Behind a turn the outputs go on to their new
values for many tau, so a window begins with values of the one before. It is found in
the noise, which it filters like everything else (`fieldcal.windows.smoothing`), and
undone sample by sample. A sensor's own filter is quicker (`bandwidth`). Source: model
of this project.

>>> import numpy as np
>>> y = 1.0 - 0.9 ** np.arange(5)[:, None]  # from 0 to 1, of which it has a tenth
>>> without_smoothing(y, np.arange(5.0), 0.9).T.round(9)
array([[0., 1., 1., 1., 1.]])
"""

from __future__ import annotations

import numpy as np

from fieldcal.calibration.wording import format_with_sigma
from fieldcal.core.samples import ACC, CHANNELS, GYR
from fieldcal.physics.effect import Chain, Param
from fieldcal.physics.recording import CheckedSamples, Fault
from fieldcal.windows.smoothing import find_smoothing, without_smoothing

LEAST_S = 0.15
"""Least time constant, s: what is quicker is over when a window begins, and turns tell
it better (`bandwidth`)."""


class Smoothing(Chain):
    """Time constants of the smoothing of the accelerometers and of the gyroscopes."""

    params = (Param("acc", "s", 1.0), Param("gyr", "s", 1.0))
    covariate = "neighbouring samples that differ by less than the noise of a window"
    treatment = "mend"
    place = 1  # values off by whole bytes jump, which is then smoothed as well
    decided_by = "samples as the device sends them"
    cure = (
        "Record the outputs as the device sends them, without a filter or moving"
        " average of the program; or rest longer before each window."
    )
    source = "model of this project"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """The time constants of the sensors whose outputs are smoothed."""
        block = recording.block
        six, t = block.six, block.t
        interval = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        values: dict[str, float] = {}
        sigmas: dict[str, float] = {}
        channels: list[str] = []
        both = find_smoothing(six, recording.windows, recording.steps)
        for name, triad, found in zip(("acc", "gyr"), (ACC, GYR), both, strict=True):
            if found is None or interval * found.samples < LEAST_S:
                continue
            six = six.copy()
            six[:, triad] = without_smoothing(six[:, triad], t, found.kept)
            values[name] = interval * found.samples
            sigmas[name] = interval * found.samples_sigma
            channels += CHANNELS[triad]
        if not channels:
            return []
        ends = float(t[0]), float(t[-1])
        return [Fault(channels[0], values, sigmas, *ends, mended=six,
                      channels=tuple(channels))]  # fmt: skip

    def say_repaired(self, fault: Fault) -> str:
        """Which sensors, and with what time constants."""
        each = []
        for name, sigma in fault.sigmas.items():
            value, error = format_with_sigma(float(fault.values[name]), sigma)
            sensor = "accelerometers" if name == "acc" else "gyroscopes"
            each.append(f"{value} ± {error} s ({sensor})")
        return (
            "a program smoothed the outputs, with a time constant of"
            f" {' and '.join(each)}: this is undone here; record them as the device"
            " sends them"
        )
