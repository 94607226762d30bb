"""The random walk of a bias over months, from a device's earlier calibrations.

A bias x_i was known at the time t_i with the variance V_i. Of this a share r is an
error that all calibrations have in common, as of base, fixture and what the factory
left; it does not affect differences. With h the times between them and D the matrix of
their differences, and w_i what a usual temperature coefficient of the device makes of
the temperature at t_i,

    D x ~ N(0, K^2 diag h + A_r),  A_r = (1 - r) D diag V D' + D w w' D'           (1)

Calibrations in summer and winter differ by one coefficient, of either sign, and not by
a walk. In the axes of diag(h)^-1/2 A_r diag(h)^-1/2, with a its eigenvalues and z the
differences there, the density of ln K^2 and r with the reference prior is

    ln p = ln p(r) - sum (ln l + z^2 / l) / 2 + ln(sum (K^2 / l)^2) / 2            (2)
    l = K^2 + a

Few calibrations do not exclude a walk that their own errors hide, so all of p is kept
and not its maximum. Symbols: x, V of the channel's unit and its square, t and h s,
K the unit per sqrt(s). Source: Jeffreys 1946.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array

SHARES = {0.0: 0.5, 0.3: 1 / 6, 0.7: 1 / 6, 0.95: 1 / 6}
"""Prior probability of each r of (1): a common error is as likely as none."""

SIZES = np.geomspace(1e-6, 1e6, 241)
"""K^2 at which (2) is evaluated, over what the values scatter and are uncertain by."""

WALKS = 40
"""Parts of equal probability in which K^2 is told."""


class EarlierBias(NamedTuple):
    """A bias by an earlier calibration of the device.

    Attributes
    ----------
    seconds : when it was recorded
    value : in the channel's unit
    variance : of the value
    warmth : usual temperature coefficient times the temperature less that of the other
        calibrations, in the channel's unit; 0 if it is unknown

    """

    seconds: float
    value: float
    variance: float
    warmth: float = 0.0


def walk_from_history(biases: Sequence[EarlierBias]) -> Array:
    """K^2 in the middle of each of `WALKS` parts of equal probability, (2).

    Parameters
    ----------
    biases : three or more, at times that increase

    """
    t, x, v, w = np.array(biases).T
    steps = np.diff(np.eye(len(t)), axis=0) / np.sqrt(np.diff(t))[:, None]
    warm = steps @ w
    told = [
        _in_own_axes(share * (steps * v) @ steps.T + np.outer(warm, warm), steps @ x)
        for share in (1 - np.array(list(SHARES)))
    ]
    size = float(np.mean(told[0][0] + told[0][1]) + 1e-300)
    sizes = SIZES * size
    log_p = np.zeros((len(sizes), len(SHARES)))
    for column, ((a, squares), chance) in enumerate(
        zip(told, SHARES.values(), strict=True)
    ):
        level = sizes[:, None] + a
        log_p[:, column] = -0.5 * (np.log(level) + squares / level).sum(axis=1)
        log_p[:, column] += 0.5 * np.log(((sizes[:, None] / level) ** 2).sum(axis=1))
        log_p[:, column] += np.log(chance)  # (2)
    below = np.cumsum(np.exp(log_p - log_p.max()).sum(axis=1))
    middles = (np.arange(WALKS) + 0.5) / WALKS
    walks: Array = np.interp(middles, below / below[-1], sizes)
    return walks


def _in_own_axes(covariance: Array, steps: Array) -> tuple[Array, Array]:
    """Eigenvalues a of a covariance, and z^2 of differences in its axes."""
    eigenvalues, axes = np.linalg.eigh(covariance)
    return np.maximum(eigenvalues, 0.0), (axes.T @ steps) ** 2
