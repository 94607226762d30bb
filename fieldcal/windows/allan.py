"""Allan deviation of a long recording at rest: what averaging can reach.

    sigma^2(tau) = <(y_k+1 - y_k)^2> / 2          y: means over tau, overlapping

It is the standard error of a mean over tau s: its square is half of that by which the
next mean differs, to which both contribute. It falls as 1/sqrt(tau) for white noise, is
constant for flicker (the bias instability), and rises for a random walk, for which a
longer mean is less accurate. Device axes, SI. Source: IEEE 952-1997 annex C; intervals
by Greenhall and Riley 2003. The sums are allantools', which fieldcal installs as its
extra ``allan``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.core.sampling import PAUSE_PERIODS
from fieldcal.windows.cells import resolution
from fieldcal.windows.noise import STEP_SAMPLES, short_lag_noise, smallest_steps
from fieldcal.windows.rounding import variance_of_mean

MIN_RECORDING_S = 60.0
"""Shortest recording that is evaluated, s."""

MAX_GAP_S = 1.0
"""Longest gap that is tolerated, s; if samples are seldom, the longest that is no
pause."""

AVERAGES = 4
"""Fewest means for a deviation: the longest tau is a fourth of the recording."""


@dataclass(frozen=True, slots=True)
class AllanDeviation:
    """Allan deviation of the six channels, `samples.CHANNELS` order.

    Attributes
    ----------
    tau : (k,) s, about three to the octave
    deviation : (k, 6) m/s^2 and rad/s; nan where not measured
    low, high : (k, 6) the interval that holds the true value in 68 cases of 100
    rounding : (6,) deviation that rounding leaves in any mean, however long

    """

    tau: Array
    deviation: Array
    low: Array
    high: Array
    rounding: Array

    def sigma_of_mean(self, seconds: float) -> Array:
        """Standard error of a mean over `seconds`, (6,), m/s^2 and rad/s.

        Raises
        ------
        InputError
            If the recording is too short to know.

        """
        if not self.tau[0] <= seconds <= self.tau[-1]:
            raise InputError(
                f"the recording tells the error of means over {self.tau[0]:.2g} to "
                f"{self.tau[-1]:.3g} s, not {seconds:g} s: record "
                f"{AVERAGES * seconds:.0f} s at rest"
            )
        logs = np.log(np.where(self.deviation > 0, self.deviation, np.nan))
        at = [np.interp(np.log(seconds), np.log(self.tau), column) for column in logs.T]
        # neighbouring means have the same rounding error: their difference hides it
        sigma: Array = np.hypot(np.nan_to_num(np.exp(at)), self.rounding)
        return np.where(sigma > 0, sigma, np.nan)

    @property
    def best(self) -> Array:
        """Averaging time with the least deviation of each channel, (6,) s.

        It is the longest tau if the deviation still falls at the end of the recording;
        nan where not measured.
        """
        filled = np.where(np.isnan(self.deviation), np.inf, self.deviation)
        best = self.tau[np.argmin(filled, axis=0)]
        return np.where(np.isnan(self.deviation).all(axis=0), np.nan, best)


def allan_deviation(block: Block) -> AllanDeviation:
    """Allan deviation of a recording of a device at rest.

    The samples count as evenly spaced, as a device takes them.

    Raises
    ------
    InputError
        If the recording is too short or has a gap, or allantools is not installed.

    """
    _check_recording(block)
    tools = _allantools()
    six = np.where(np.isfinite(block.six), block.six, np.nan)
    rate = (len(block) - 1) / float(block.t[-1] - block.t[0])
    longest = len(block) / rate / AVERAGES
    tau = np.geomspace(0.1, longest, round(3 * np.log2(longest / 0.1)))
    m = np.unique(np.maximum(1, np.round(tau * rate))).astype(int)
    freedom = [
        tools.edf_greenhall(0, 2, int(number), len(six), overlapping=True)
        for number in m
    ]
    table = np.full((3, len(m), 6), np.nan)
    for channel in range(6):
        x = six[:, channel]
        if np.isnan(x).mean() < 0.5:
            table[:, :, channel] = _channel_deviation(
                tools, _interpolated(x), rate, m, freedom
            )
    pieces = [
        six[first : first + STEP_SAMPLES] for first in range(0, len(six), STEP_SAMPLES)
    ]
    steps = smallest_steps(pieces)
    step = resolution(np.where(steps > 0, steps, np.inf))
    rounding = np.sqrt(variance_of_mean(step, np.nan_to_num(short_lag_noise(six))))
    return AllanDeviation(m / rate, table[0], table[1], table[2], rounding)


def _channel_deviation(
    tools: Any, x: Array, rate: float, m: Array, freedom: list[float]
) -> Array:
    """Deviation with its interval, (3, k), at m samples (k,).

    `freedom` are the degrees of freedom (k,), which all channels have in common.
    """
    _, deviation, _, n = tools.oadev(x - x.mean(), rate, "freq", m / rate)
    if len(deviation) != len(m):
        raise AssertionError("allantools leaves out no tau with four means or more")
    low, high = np.empty_like(deviation), np.empty_like(deviation)
    for i, (value, known) in enumerate(zip(deviation, freedom, strict=True)):
        low[i], high[i] = tools.confidence_interval(value, edf=known)
    return np.array([deviation, low, high])


def _interpolated(x: Array) -> Array:
    """Values (n,) with missing ones interpolated linearly."""
    known = np.isfinite(x)
    rows = np.arange(len(x))
    filled: Array = np.interp(rows, rows[known], x[known])
    return filled


def _check_recording(block: Block) -> None:
    seconds = float(block.t[-1] - block.t[0]) if len(block) else 0.0
    if seconds < MIN_RECORDING_S:
        raise InputError(
            f"a recording of {seconds:.0f} s is too short for an Allan deviation: "
            f"record {MIN_RECORDING_S:.0f} s or more at rest"
        )
    steps = np.diff(block.t)
    worst = int(np.argmax(steps))
    if steps[worst] > max(MAX_GAP_S, PAUSE_PERIODS * float(np.median(steps))):
        raise InputError(
            f"no samples for {steps[worst]:.1f} s from {block.t[worst]:.2f} s on: take "
            "the part of the recording before or after"
        )
    if not np.isfinite(block.six).any():
        raise InputError(f"none of {', '.join(CHANNELS)} was measured")


def _allantools() -> Any:
    try:
        import allantools
    except ImportError as missing:
        raise InputError(
            "Allan deviations need allantools: pip install 'fieldcal[allan]'"
        ) from missing
    return allantools
