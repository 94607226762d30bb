"""Detects gyroscopes whose bias the device subtracts at rest.

A device removes the bias where it sees that it rests. One that is held in a hand is
turned to and fro all the time and never sees that; its means are zero within that
motion, whatever the bias, so that nothing is said of it.

A device may follow its bias at rest (`tracked_bias`). The likelihood ratio of its rates
at rest to those of gyroscopes that keep a bias (`bias_evidence`) is

    B = mean over cases of p(rates | follows) / mean over cases of p(rates | keeps)
                                                                                   (1)

Cases are time constants, what turns put into the estimate, the dependence of w on how
the device lies, and slow changes of the bias (`bias_cases`). A bias that is kept has a
spread of s_b, or ten times that, and a few were calibrated before, so that no rates are
taken for those of a device that removes its bias only because they are small: they must
also return to zero, or be smaller than the Earth's rate. Of a share UNBIASED the bias
is known: only the Earth's rate stays (`earth_rate_alone`).

A device may also subtract the mean of its first T seconds at rest until the next turn.
After that, its rates are the noise of the mean, of another value after each turn,

    u = 0,  var w = S / T;     B = mean over T of B of the rates later than T      (2)

If the rates during T were recorded, those before the subtraction are known, and take
the place of the outputs in the likelihood of a device that removes its bias
(`subtracted_means`). A bias that is followed is as likely as both of these. An
autopilot that reports the offset that it subtracts has, with even odds, averaged it
over any T when it started: a bias of S / T then remains. Of gyroscopes with a bias at
most one in x has a B above x; a share TRACKING of all devices removes the bias.
Device axes, rad/s. Source: Markov's inequality for a likelihood ratio.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.acceptance.bias_cases import BiasSpread
from fieldcal.acceptance.bias_evidence import (
    removals_by_likelihood,
    removals_of_recorded_means,
)
from fieldcal.acceptance.rest_steps import (
    SPECTRUM,
    noise_of_samples,
    rest_steps,
    sample_period,
    stops_at_rest,
)
from fieldcal.acceptance.subtracted_means import steps_before_means
from fieldcal.acceptance.zero_rates import log_odds_of_no_bias, zero_rates
from fieldcal.core.probability import probability_of_log_odds
from fieldcal.core.samples import Array, Block, Index
from fieldcal.windows import Average

MIN_WINDOWS = 2
"""Fewest windows that tell anything."""

TRACKING = 0.01
"""Share of devices that subtract their bias at rest; low-cost ones often do."""

DOUBT = 0.05
"""Probability of such a device above which there is no GO."""

LEAST_NOISE = 1e-4
"""Least noise of a mean over a second, as part of the spread of biases: where steps are
coarse and there is hardly any noise, rounding errs by more than this."""

MOVED, MOVED_S = 2e-3, 0.25
"""Spread of mean rates over so long, rad/s and s, beyond which a device moves: 0.1
deg/s. A hand makes 5e-3 to 2e-2, and noise of a low-cost gyroscope at rest 6e-4."""

UNKNOWN = np.full(3, np.nan)
"""Biases of which nothing is known."""


def bias_removal_probability(
    windows: Sequence[Average],
    block: Block,
    keeps: BiasSpread,
    seen: tuple[Array, Array] = (UNKNOWN, UNKNOWN),
) -> tuple[float, str]:
    """Probability that the device subtracts its bias at rest, and how, in words.

    0 if there are too few windows, if a hand holds the device, or if it is stated that
    it subtracts none. `seen` are estimated biases and their errors, (3,) each, rad/s.
    They count on axes that read zero in all samples at rest (`zero_rates`).
    """
    held = [one for w in windows if len(one := block.between(w.start, w.end))]
    if keeps.stated or len(held) < MIN_WINDOWS or _never_rests(held):
        return 0.0, ""
    zero = zero_rates(held)
    bias, sigma = (part[zero] for part in seen)
    log_odds = log_odds_of_no_bias(bias, sigma, keeps.repeat)
    if keeps.averaged:
        log_odds -= float(np.logaddexp(log_odds, 0.0) - np.log(2.0))
    log_odds += np.log(TRACKING)
    if zero.all():
        return float(probability_of_log_odds(log_odds)), "all samples are zero"
    return _removal_behind_noise(held, block, np.flatnonzero(~zero), keeps, log_odds)


def _removal_behind_noise(
    held: Sequence[Block], block: Block, axes: Index, keeps: BiasSpread, prior: float
) -> tuple[float, str]:
    """The probability with that of some axes, from prior log odds, and how."""
    held = [one for one in held if len(one) >= SPECTRUM]
    noise = noise_of_samples(held, axes) if held else np.zeros((0, len(axes)))
    seen = np.isfinite(noise)
    if seen.sum() < len(axes) * MIN_WINDOWS or not seen.any(axis=0).all():
        return 0.0, ""
    of_second = np.nanmedian(noise, axis=0) * np.sqrt(sample_period(held[0]))
    density = np.maximum(of_second, LEAST_NOISE * keeps.repeat) ** 2
    stops = stops_at_rest(held, block, noise)
    ways = [
        *removals_by_likelihood(rest_steps(stops, axes), density, keeps),
        *removals_of_recorded_means(
            *steps_before_means(stops, block, axes), density, keeps
        ),
    ]
    every = np.array([way.log_odds for way in ways])  # (1), (2)
    chance = float(probability_of_log_odds(np.logaddexp.reduce(every) + prior))
    return chance, ways[int(np.argmax(every))].how


def _never_rests(held: Sequence[Block]) -> bool:
    """Whether most windows show a motion that no device takes for rest."""
    moves = []
    for one in held:
        parts = int((one.t[-1] - one.t[0]) / MOVED_S) if len(one) > 1 else 0
        if 1 < parts <= len(one):
            each = len(one) // parts
            means = one.gyr[: each * parts].reshape(parts, each, 3).mean(axis=1)
            moves.append(float(np.median(np.nan_to_num(means.std(axis=0)))))
    return bool(moves) and float(np.median(moves)) > MOVED
