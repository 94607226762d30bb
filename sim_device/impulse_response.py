"""Filtering of the outputs by an impulse response between motion and samples.

    U(t) = int_0^inf u(t - T s) h(s) ds

u a noiseless output, h the response to an impulse in units of a time T, s. By Simpson's
rule, with shares of the past that add up to 1.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import NOT_NEGATIVE, Number, SimulatedEffect

Outputs = Callable[[Array], Array]
"""Outputs (6, n) at times (n,) s."""

Past = list[tuple[float, float]]
"""Pairs of an age, in units of T, and the weight of the output at that age."""


def past_instants(response: Callable[[Array], Array], until: float, steps: int) -> Past:
    """Ages up to `until` and their weights, by Simpson's rule in even `steps`."""
    ages = np.linspace(0.0, until, steps + 1)
    shares = response(ages) * np.where(np.arange(steps + 1) % 2, 4.0, 2.0)
    shares[[0, -1]] /= 2
    return list(zip(ages.tolist(), (shares / shares.sum()).tolist(), strict=True))


def convolve(outputs: Outputs, t: Array, rows: slice, scale: float, by: Past) -> Array:
    """Convolve some rows of outputs with a response; `scale` is T, s."""
    out = np.zeros((len(range(6)[rows]), len(t)))
    for age, share in by:
        out += share * outputs(t - scale * age)[rows]
    return out


class SimulatedLowPass(SimulatedEffect):
    """Time constants of both triads, s.

    A subclass has its response, the time constants of the past that count, and how many
    parts of them. Vibration is drawn sample by sample and passes.
    """

    NUMBERS = {
        "acc": Number(0.0, NOT_NEGATIVE),
        "gyr": Number(0.0, NOT_NEGATIVE),
    }
    PAST: ClassVar[float]
    STEPS: ClassVar[int]

    @staticmethod
    @abstractmethod
    def response(age: Array) -> Array:
        """The response to an impulse at ages in time constants, up to a factor."""

    def filtered_outputs(self, outputs: Outputs, t: Array) -> Array:
        """Outputs (6, n) at t (n,) s as the sensors follow them."""
        now, by = outputs(t), past_instants(self.response, self.PAST, self.STEPS)
        for rows, tau in ((slice(3), self["acc"]), (slice(3, 6), self["gyr"])):
            if tau:
                now[rows] = convolve(outputs, t, rows, tau, by)
        return now
