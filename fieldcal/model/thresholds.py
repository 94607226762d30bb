"""Thresholds of everything that is said, each with its reason.

From when samples show that something is there at all is in `detections`. Prior
probabilities and typical sizes are in `priors`. `tolerances` and `resolutions` bound
errors and the duration of the calculation; they are not meant to decide anything.
"""

from __future__ import annotations

import math

# -- what is said of causes

NAMED = 0.5
"""Probability from which an effect is reported, and errors are taken to be as large as
in a coarser grade."""

DIFFERS = 0.9
"""Probability from which two recordings are said to differ in something. Nothing needs
a name there, as what a recording leaves unexplained does, and a gate must rarely be
wrong."""

LOOKED_AT = 0.01
"""Probability below which an explanation, that a window is bad, or a counter that began
anew and looks as if it had gone on, is not looked at: it moves no interval."""

ALIAS_LOG_MARGIN = -math.log(LOOKED_AT)
"""Evidence, ln, by which an explanation may be behind and still stand for another: 100
to 1, which no one would question."""

DETERMINED = 0.3
"""Largest part of its variance before the rows that a parameter that is told may
keep."""

STANDS_OUT = 3.5
"""Standard deviations from which a position, a parameter in a sentence, or the windows
with a cause stand out: one in two thousand by chance, and there are hundreds."""

DECIDES = 5.0
"""Standard deviations from which something is beyond doubt: the channel that a mismatch
is in, an instant that cannot have been, two causes at one position, a device that still
moves or wanders in a hand, a rate that is more than the Earth's."""

IN_CHANNEL = DECIDES**2
"""Squares that a channel has to lose for the mismatch to be in it."""

IN_CHANNEL_PART = 0.03
"""The same as part of the most that any channel, or turn, loses: less is a trace of
what is elsewhere."""

IN_OUTPUT_PART = 0.1
"""Amplitude of an output in turns, of the largest of its triad, from which a filter or
a delay is said to be in it. With 0.17, which is the part of squares above, a filter of
all gyroscopes was said to be in one of them."""

SEES_EARTH = 20.0
"""Earth rate over the noise of one window from which tactical gyroscopes see it."""

ROUNDING_SHARE = 0.7
"""Part of the noise that rounding makes when it is most of it."""

LINE_SIGMAS = 4.0
"""Standard deviations from which a channel counts as having the line."""

LINE_BY_CHANCE = 1e-3
"""Probability that a line is said where there is none, over all frequencies."""

SHOWS_EARTH = -math.log(LINE_BY_CHANCE)
"""Rise of ln Z by the Earth's rate from which the rows show it, as of a line."""

ONE_LINE = 0.65
"""Part of the energy at a frequency that one amplitude and phase must take to be a
line: a hand that trembles has another phase each time."""

LINE_LASTS = 0.2
"""Part of a line in either half of the windows at least, but for `WITHIN_NOISE`: what
fades after turns has lines as well."""

WITHIN_NOISE = 3.0
"""Standard deviations up to which a level, or a part of a line, may be off by noise."""

MAX_CLIPPED_SHARE = 1e-3
"""Part of a window at the rail that makes its mean useless."""

NOT_HELD_DEG = 10.0
"""Angle from which a device was not held where it was, deg: no hand is so far off."""

LITTLE_LOG_GAIN = 2.0
"""Rise of ln L by a cause that takes next to nothing: two parameters of noise do."""

# -- what is said of a calibration

TILT_LOG_MARGIN = 3.0
"""Evidence, ln, from which one model of the tilt counts as the better one."""

BEYOND_NOISE = 0.01
"""Probability of a larger chi2 from which the scatter counts as beyond the noise."""

MENTIONED = 0.1
"""Probability from which a cause is named in a sentence, and from which what may stand
in the place of another makes that ambiguous."""

WRONG_MODEL = 9.0
"""chi2 per degree of freedom from which the model, not the noise, is at fault."""

FEW_DOF = 5
"""Degrees of freedom below which a residual says little of itself: its size is then
uncertain by a third."""

USEFUL = {
    "acc_bias": 1.0, "acc_scale": 0.1, "cross_coupling": 0.1,
    "gyr_bias": 0.1, "gyr_scale": 0.1, "gyro_cross_coupling": 0.01,
    "angle_offset": 3.0, "base_tilt": 3.0,
}  # fmt: skip
"""Standard uncertainty from which a parameter is worse than a guess, the same in a
calibration and in a diagnosis: no bias is a tenth of gravity or 6 deg/s, no scale
factor a tenth off, an axis is put in by hand to some hundredths, and an eye sees a tilt
of three degrees."""

USEFUL_TURNED = 0.01
"""The same of the scale factor of gyroscopes where turns give it: makers do better."""

MOVED_WRONG = DECIDES
"""Sigmas by which a parameter may move with what is left out before it is no longer to
be used: no navigator has that in its margin."""

MOVED = 1.0
"""Standard deviations from which what that moves is reported, and a parameter counts
as moved."""

SUSPECT = MENTIONED
"""Probability that a window is bad from which it is reported."""

CERTAIN = 1 - LOOKED_AT
"""Probability from which something is taken as sure: a window that is bad has no weight
left, and no digits are told."""

MEANINGLESS_ANGLE_DEG = 45.0
"""Size of what angles are wrong by, deg, from which they say nothing: half of what
parts one axis from the next. Nobody sets them so; session.toml is wrong."""

# -- how it is said

CLEARLY_FURTHER = 1.2
"""Times the standard deviations of another position from which one decides better
between two causes: the ladder's own order counts as long as less is gained."""

LARGEST_LOG_ODDS = 40.0
"""Largest log odds that are stated: no model is as sure as 2e17 to 1."""

MAX_LISTED_OCCURRENCES, MAX_LISTED_PLACES = 3, 6
"""Occurrences of an effect that are listed one by one, and places, or positions, that
one sentence lists: what is read at a glance."""

MAX_DECIMALS = 6
"""Decimal places above which an uncertainty is written with an exponent."""

# -- when too little was recorded

MIN_ALIKE = 3
"""Windows, turns or positions from which what one of them has of its own is told from
what all have: of two that differ, either may be the odd one."""

MIN_SINKING_POSITIONS = 4
"""Positions with known angles that distinguish a base that turns from biases."""

MAX_PREDICTION_VARIANCE = 1.0
"""Variance, (m/s^2)^2, of a prediction above which no other window checks it: the wide
priors of the estimated parameters dominate."""

MIN_FORCE_DIFFERENCE = 1e-4
"""Difference of specific force between two positions, of gravity, below which an axis
was not turned: an angle that is 0.006 deg off makes as much."""

MIN_NULL_SHARE = 1e-4
"""Share of a direction that rows do not determine from which a parameter is not
determined either: with less, what may be along that direction moves it by 1e-4."""

MAX_PROPOSED_POSITIONS = 4
"""Positions that are proposed to be added; beyond them another procedure is needed."""

# -- which explanations are looked at

VISIBLE = MOVED
"""Standard deviations below which nothing shows: the column of a typical size in all
rows together, an error of linearisation in a mean, a step after which turns need not be
linearised again."""

SIGMA_LOG_LOSS = VISIBLE**2 / 2
"""Decrease of ln L if one parameter is off by its own uncertainty: so much of a rise is
noise."""

MIN_LOG_RISE = 0.02
"""Largest rise of ln Z that counts as none: a probability moves by half a per cent."""

AVERAGED_LOG_DISTANCE = 4.0
"""Difference of log evidence to the best, beyond which a hypothesis of a given set is
left out of its average: odds of 1 to 55."""

ALTERNATIVE_LOG_DISTANCE = 6.0
"""Predicted distance from the best, ln, up to which other parameters or causes are
evaluated: what proves likelier by `PREDICTION_SLACK` is then one in twenty."""

OFFERED_LOG_DISTANCE = 12.0
"""Distance from the best, ln, up to which an offer is evaluated, and a set compared
without a part of the rows: what is further behind has odds of 1 to 160 000."""

PREDICTION_SLACK = 3.0
"""Log evidence that a full evaluation may add to the predicted score of an offer."""

MAX_CAUSES = 12
"""Causes with which a search ends: rows that take as many are of something else than
this model, as of windows in which the device was turned, and each further one is paid
with seconds. Recordings with known causes have up to four."""

LARGE_INSTABILITY = 4.0
"""Instability, in typical ones, above which causes may hide that show only together."""

MIN_INSTABILITY = 0.2
"""Smallest instability that is told from none, of the noise of a mean: it widens that
by 2 %."""

MAX_SHAPE_LOG_SIGMA = 1.0
"""Largest sigma of the logarithm of a time constant that is used: of a factor e."""

# -- positions and turns that are not as they are stated

CONVERGES_WITHIN_RAD = 0.3
"""Error of an angle from which the linearisation converges to the right one, rad."""

ALIKE = 0.05
"""Difference of two forces, of gravity, or of angles from those of another position, of
the distance between the two, up to which places are alike: three degrees."""

MAX_MISCLOSURE_RAD = 0.3
"""Largest closure that gyroscope errors can make, rad. A larger one means that outputs
were clipped, or that the device was turned otherwise than its positions say."""

MAX_WAY_CHI2 = 3.0
"""Mean square of a row on the way, after a fit of all columns, above which a hand shook
the device and the rows on the way are not used."""
