"""Biases that wander.

    dU_i = q_i dB_i,    dW_i = q_i dB_i

B independent unit Brownian motions; q m/s^2/sqrt(s) and rad/s/sqrt(s). No equation for
the outputs, but a covariance: q^2 times the time two instants have in common. It
widens the intervals. Source: IEEE Std 952, rate random walk, Allan slope +1/2.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(3), np.zeros(3), 9.8, t=np.array([0.0, 1.0, 5.0]))
>>> factor = RandomWalk().factor(x, "ax")[:, 0]
>>> factor @ factor.T  # time since the first instant that two rows share
array([[0., 0., 0.],
       [0., 1., 1.],
       [0., 1., 5.]])
"""

from __future__ import annotations

import numpy as np

from fieldcal.effects import Experience, Scatter, six
from fieldcal.samples import CHANNELS, Array


class RandomWalk(Scatter):
    """Random walk of the biases."""

    kind = "sensor"
    params = six("m/s^2/sqrt(s)", 3e-4, "rad/s/sqrt(s)", 3e-5)
    covariate = "scatter between windows beyond white noise"
    seen_in = "time"
    decided_by = "one position held for an hour, and its Allan deviation"
    source = "IEEE Std 952, rate random walk"

    def factor(self, x: Experience, name: str) -> Array:
        """Increments from row to row, summed up."""
        gaps = np.sqrt(np.diff(x.t, prepend=x.t[:1]))
        out = np.zeros((len(x), 6, len(x)))
        out[:, CHANNELS.index(name)] = np.tri(len(x)) * gaps
        return out
