"""Prior probabilities and typical sizes, each with its reason.

Chances are prior probabilities; sizes are in the units of the catalogue. Typical sizes
of an effect are in its own file.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

SIZES: Array = np.geomspace(1e-5, 1e3, 33)
"""Values of v, a factor of 1.78 apart: an evidence changes little between two."""

SIZE_TAIL = 4.0
"""A size v times what is typical is as rare as v^-TAIL: so are outliers of data
sheets."""

INSTABILITY_TAIL = 8.0
"""The same of instability: what scatters ten times as much as devices has a cause."""

BIAS_ACC, BIAS_GYR, SCALE = 0.3, 2e-2, 1e-2
"""Typical change from nominal: 30 mg, 1 deg/s, 1 %; what consumer grade reaches."""

FREE_SIZE = 30.0
"""Size of what a calibration is to find, in typical ones: it decides nothing there."""

GYRO_COUPLING_SIZE = 2.5
"""The same of the cross-coupling of gyroscopes: 0.05. Two turns do not show all of it,
and what it may be is in the scale factors; no gyroscope is further off."""

INSTABILITY_ACC, INSTABILITY_GYR = 1e-3, 3e-5
"""Typical scatter of a bias from window to window, m/s^2 and rad/s: 0.1 mg, 6 deg/h."""

CLOSURE_RAD = 5e-4
"""Typical scatter of the angle that a turn closes with, rad, beyond noise: bandwidth,
timing and the hand take half a milliradian."""

FILTERED_S = 0.1
"""Standard deviation of the time constant of a filter of the sensors, s: 1.6 Hz. Data
sheets have 5 to 260 Hz; where turns do not show it, scale factors are less certain."""

FLICKER_ACC, FLICKER_GYR = 2e-3, 1e-4
"""Typical flicker noise, m/s^2 and rad/s: where Allan deviations of consumer grade stay
level, 0.2 mg and 20 deg/h."""

FLICKER_CHANCE = 0.1
"""Chance that flicker noise, which neighbouring windows share, is more of what a bias
wanders by than what comes anew in each of them, with how the device lies."""

AXES_LOG_SPREAD = 0.3
"""Spread of the instabilities of a triad's axes, ln: they are made alike."""

UNKNOWN_ACC, UNKNOWN_GYR = 2e-2, 1e-3
"""Typical size of what no effect makes, m/s^2 and rad/s: that of the effects."""

MAX_COSINES = 80
"""Cosines of a walk or of flicker at most: one for some seconds of a session of
minutes. What they leave of what is far above the noise is as good as white."""

BESIDE_TILT_DEG = 0.05
"""What a base is off by beside joints that are, and joints beside a base, deg: one of
them may explain the positions, and the other one is there as well. A bubble level shows
no less."""

SCALE_WARMING = 0.25
"""How much a scale factor of an accelerometer changes with the temperature, at 1 g, as
a part of what its bias does: 0.02 %/K beside 0.8 mg/K of an MPU-6050."""

MISSET_DEG = 3.0
"""Typical error of a position whose angle is not the stated one, deg."""

SINGLE_MISTAKE_DEG, REPEATED_MISTAKE_DEG, GAUGE_ERROR = 10.0, 0.2, 5e-3
"""Largest usual mistake of one position, deg, of an angle that is repeated, deg, and of
a gauge that all angles come from, as a part of them."""

LEAN_CHANCE, LEAN_RAD = 0.1, 2e-4
"""Chance that what a device lies on gives way while it rests, and by how much, rad:
tyres, foam and grass do, by tenths of a milliradian in a minute."""

SINK_CHANCE, SINK_RAD, SINK_FADING = 0.02, 5e-4, 0.2
"""Chance that the base of a fixture turns while it is used, by how much, rad, and how
much smaller each polynomial of that is than the one before: a tripod on soil or a table
that bends settles within one to several times a session."""

LOST_TURN_CHANCE, LOST_TURN_RAD = 0.02, 0.03
"""Chance that the gyroscopes did not follow one of the turns, and the angle that they
missed, rad: a tenth of a second of a turn by hand."""

ARRIVAL_S = 0.3
"""Standard uncertainty of the instant at which a turn by hand ends."""

BUILD_UP_ON_WAY, BUILD_UP_AT_END, BUILD_UP_S = 0.5, 0.15, 2.0
"""How far what settles may be off on the way and at its end, in its size, and how
smoothly, s."""

CLOCK_S, CLOCK_RATE = 1e-2, 1e-4
"""Typical error of an alignment by correlation, s, and of a quartz, 1."""

AXES_TURNED = 0.1
"""Typical turn between two axes that are taken for the same, rad."""

UPRIGHT, UNSEEN = 10.0, np.repeat([0.5, 0.01], 3)
"""What a channel may have that a reference says nothing of, m/s^2 and rad/s: gravity
along the axis that stands upright, and three degrees of it along those that lie."""

SMALL_ROTATION = 1.0
"""Turns of a position whose orientation nobody knows, rad: any."""

LOOSE_FIXTURE_CHANCE, LOOSEST_FIXTURE = 0.2, 100.0
"""Chance that something beside the device scatters the windows of a given set, a
fixture that does not return or an effect that is left out, and by up to so many typical
instabilities: 0.1 m/s^2, a joint that comes back to half a degree."""

BAD_WINDOW_CHANCE = 5e-3
"""Chance that a given window is disturbed in a way that it does not show itself."""

COMPANION_CHANCE = 0.3
"""Chance of an effect in the gyroscopes when the accelerometers have it, and back; and
of what every triad has until it is calibrated, when another of these is there."""

SINGLE_AXIS_SHARE = 0.1
"""Part of the biases that wander of which one axis does, and the others do not."""

WRONG_LATITUDE_CHANCE = 1e-3
"""Chance that a latitude that somebody wrote down is another one."""

RESTART_CHANCE = 0.1
"""Chance that what begins at an instant begins where samples are missing between two
positions: a link fails more often than a supply."""

BOTH_RESTART_ODDS = 20.0
"""Odds that all axes of a triad do so if those of the other one do, by what is typical;
and the inverse that some do, or by less."""

AS_STATED_CHANCE = 0.2
"""Chance that a kind of error is as small as the stated grade has it in a device with
biases of a coarser one: its gyroscopes tell little of its accelerometers."""

UNKNOWN_FUNCTION_CHANCE = 5e-4
"""Chance of a function that no effect makes, for each covariate."""


def instability_density_of_given_set() -> Array:
    """Prior of each of `SIZES` of instability if the set is given, without a search."""
    wide = (SIZES > 1) & (SIZES <= LOOSEST_FIXTURE)
    share: Array = (1 - LOOSE_FIXTURE_CHANCE) * density(
        INSTABILITY_TAIL
    ) + LOOSE_FIXTURE_CHANCE * wide / wide.sum()
    return share


def density(tail: float = SIZE_TAIL) -> Array:
    """Prior of each of `SIZES`: even in ln v up to 1, then falling as v^-tail."""
    weight = 1 / (1 + SIZES**tail)
    share: Array = weight / weight.sum()
    return share
