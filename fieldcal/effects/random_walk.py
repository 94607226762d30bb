"""Biases that wander.

    dU_i = q_i dB_i,    dW_i = q_i dB_i

B independent unit Brownian motions; q m/s^2/sqrt(s) and rad/s/sqrt(s). No equation for
the outputs, but a covariance: q^2 times the time two instants have in common. It
widens the intervals. Allan deviations of MEMS that users publish with Kalibr say 1e-5
to 3e-5 rad/s/sqrt(s), one of eight 2e-4. Source: IEEE Std 952, rate random walk, Allan
slope +1/2.

>>> RandomWalk().unit("ax")
'm/s^2/sqrt(s)'
"""

from __future__ import annotations

from fieldcal.physics.effect import Scatter, six


class RandomWalk(Scatter):
    """Random walk of the biases."""

    kind = "sensor"
    params = six("m/s^2/sqrt(s)", 3e-4, "rad/s/sqrt(s)", 3e-5)
    covariate = "scatter between windows beyond white noise"
    seen_in = "time"
    absent = "on average"
    decided_by = "one position held for an hour, and its Allan deviation"
    cure = (
        "Nothing takes it out: average no longer than the Allan deviation "
        "falls, and calibrate shortly before use."
    )
    source = "IEEE Std 952, rate random walk"
