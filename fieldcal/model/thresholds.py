"""From where on something counts: every threshold of what is said, each with why.

Chances and typical sizes, from which probabilities are made, are in `priors`; how far
a search looks, which changes the time that it takes and nothing that is said, stands
beside each search.
"""

from __future__ import annotations

# -- what is said of causes

NAMED = 0.5
"""Probability from which an effect is reported."""

SAME = 4.6
"""Evidence, ln, by which an explanation may be behind and still stand for another: 100
to 1, beyond which nobody would ask."""

OPEN = 0.1
"""Probability of what may stand in its place from which a cause is ambiguous."""

DETERMINED = 0.3
"""Largest part of its variance before the rows that a parameter that is told may
keep."""

SHOWN_BY_WINDOWS = 12.0
"""Decrease of the weighted squares from which a cause shows in the windows."""

IN_CHANNEL = 25.0
"""Squares that a channel has to lose for the mismatch to be in it."""

IN_CHANNEL_PART = 0.03
"""The same as part of the most that any channel loses: less is a trace of what is
elsewhere."""

STANDS_OUT = 3.5
"""Standard deviations from which a position stands out."""

DECIDES = 5.0
"""Difference in white noise of a window's mean that decides."""

SHOWS_EARTH = 6.9
"""Rise of ln Z by the Earth's rate from which the rows show it: 1000 to 1."""

SEES_EARTH = 20.0
"""Earth rate over the noise of one window from which tactical gyroscopes see it."""

ROUGH = 0.7
"""Part of the noise that rounding makes when it is most of it."""

LINE = 4.0
"""Standard deviations from which a channel counts as having the line."""

LINE_BY_CHANCE = 1e-3
"""Probability that a line is said where there is none, over all frequencies."""

ONE_LINE = 0.65
"""Part of the energy at a frequency that one amplitude and phase must take to be a
line: a hand that trembles has another phase each time."""

LINE_LASTS, LINE_LASTS_SIGMAS = 0.2, 3.0
"""Part of a line in either half of the windows at least, but for so many sigmas: what
fades after turns has lines as well."""

CLIPPED = 1e-3
"""Part of a window at the rail that makes its mean useless."""

NOT_HELD_DEG = 10.0
"""Angle from which a device was not held where it was, deg: no hand is so far off."""

TAKES_LITTLE = 2.0
"""Rise of ln L by a cause that takes next to nothing: two parameters of noise do."""

IN_PARAGRAPH = 3.0
"""Standard deviations from which the paragraph names a parameter."""

# -- what is said of a calibration

BETTER_TILT = 3.0
"""Evidence, ln, from which one model of the tilt counts as the better one."""

BEYOND_NOISE = 0.01
"""Probability of a larger chi2 from which the scatter counts as beyond the noise."""

MENTIONED = 0.1
"""Probability from which a cause is named in a sentence."""

WRONG_MODEL = 9.0
"""chi2 per degree of freedom from which the model, not the noise, is at fault."""

TURNS_TELL = 5
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

MOVED_WRONG = 5.0
"""Sigmas by which a parameter may move with what is left out before it is no longer to
be used: no navigator has that in its margin."""

MOVED = 1.0
"""Standard deviations from which what that moves is reported, and a parameter counts
as moved."""

LOOKED_AT = 0.01
"""Probability below which an explanation is not looked at: it moves no interval."""

DOUBTED = 0.02
"""Probability that a window is bad below which it moves no interval."""

SUSPECT = 0.1
"""Probability that a window is bad from which it is reported."""

CERTAIN = 0.99
"""The same from which it has no weight left."""
