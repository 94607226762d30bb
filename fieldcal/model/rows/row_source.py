"""Samples of a session, with what is needed to reduce them to rows."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from fieldcal.core.samples import Array, Block, Mask
from fieldcal.core.sampling import sampling_rate
from fieldcal.model.rows.block_means import masked
from fieldcal.model.rows.passed_outputs import PassedOutputs
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.rows.vibration import WindowNoise, measure_window_noise
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.session.description import Description


@dataclass(frozen=True)
class RowSource:
    """Samples of a session, with what is needed to reduce them to rows.

    Attributes
    ----------
    block : the samples, corrected
    about : description of the session
    usable : (n, 6) samples that may be used
    rest_began : (p,) instant from which the device was at rest in each position, s
    thermometer : the temperature
    pace : seconds of the device's clock in a true second
    sway_variance : (p, 6) variance of each window's mean that remains after a base's
        sway was subtracted, SI squared; None if the base does not sway
    sway_noise : (6,) standard deviation of one sample on such a base; the subtraction
        removes slow noise as well
    sway_gravity_sigma : m/s^2, standard deviation of the apparent loss of gravity by
        sway

    """

    block: Block
    about: Description
    usable: Mask
    rest_began: Array
    thermometer: Thermometer
    pace: float = 1.0
    sway_variance: Array | None = None
    sway_noise: Array | None = None
    sway_gravity_sigma: float = 0.0

    @property
    def complete_samples(self) -> RowSource:
        """The source with only those samples whose outputs are all usable.

        Unchanged if there are no such samples, or no others.
        """
        every = self.usable.all(axis=1)
        if every.all() or not every.any():
            return self
        kept = {f.name: getattr(self.block, f.name)[every] for f in fields(Block)}
        return replace(self, block=Block(**kept), usable=self.usable[every])

    @cached_property
    def rate(self) -> float:
        """Samples a second."""
        return sampling_rate(self.block)

    @cached_property
    def passed(self) -> PassedOutputs:
        """Integral of the outputs since the start."""
        return PassedOutputs.of(self.block, self.about.nominal)

    @cached_property
    def window_noise(self) -> WindowNoise:
        """Noise of the windows that have samples."""
        block = masked(self.block, self.usable)
        windows = window_bounds(block, self.about)
        held = np.diff(windows, axis=1)[:, 0] > 1
        return measure_window_noise(block, windows[held], self.rate)
