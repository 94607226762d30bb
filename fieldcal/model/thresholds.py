"""Thresholds of everything that is reported, each with its reason.

Prior probabilities and typical sizes are in `priors`. Limits of a search, which change
its duration and nothing that is reported, are in the module of that search.
"""

from __future__ import annotations

import math

# -- what is said of causes

NAMED = 0.5
"""Probability from which an effect is reported."""

DIFFERS = 0.9
"""Probability from which two recordings are said to differ in something. Nothing needs
a name there, as what a recording leaves unexplained does, and a gate must rarely be
wrong."""

ALIAS_LOG_MARGIN = 4.6
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
is in, an instant that cannot have been, two causes at one position."""

IN_CHANNEL = DECIDES**2
"""Squares that a channel has to lose for the mismatch to be in it."""

IN_CHANNEL_PART = 0.03
"""The same as part of the most that any channel loses: less is a trace of what is
elsewhere."""

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

LINE_LASTS, LINE_LASTS_SIGMAS = 0.2, 3.0
"""Part of a line in either half of the windows at least, but for so many sigmas: what
fades after turns has lines as well."""

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

MIN_TURN_DOF = 5
"""Degrees of freedom of the turns from which their residual says something."""

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

LOOKED_AT = 0.01
"""Probability below which an explanation, or that a window is bad, is not looked at: it
moves no interval."""

SUSPECT = MENTIONED
"""Probability that a window is bad from which it is reported."""

CERTAIN = 1 - LOOKED_AT
"""Probability from which something is taken as sure: a window that is bad has no weight
left, and no digits are told."""

MEANINGLESS_ANGLE_DEG = 45.0
"""Size of what angles are wrong by, deg, from which they say nothing: half of what
parts one axis from the next. Nobody sets them so; session.toml is wrong."""
