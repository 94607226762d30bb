"""Prior probabilities and typical sizes, each with its reason.

Chances are prior probabilities; sizes are in the units of the catalogue. Typical sizes
of an effect are in its own file.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fieldcal.core.samples import Array

SIZES: Array = np.geomspace(1e-5, 1e3, 33)
"""Values of v, a factor of 1.78 apart: an evidence changes little between two."""

SIZE_TAIL = 4.0
"""The prior density of ln v falls as v^-TAIL above the typical size, as the outliers of
data sheets do."""

INSTABILITY_TAIL = 8.0
"""The same for instability: a scatter ten times that of devices has another cause."""

BIAS: Array = np.repeat([0.3, 2e-2], 3)
"""Typical bias: 30 mg, 1 deg/s; what consumer grade reaches. Here and below, sizes of
the six outputs are (6,), m/s^2 and rad/s."""

SCALE = 1e-2
"""Typical change of a scale factor from nominal: 1 %, as consumer grade has."""

FREE_SIZE = 30.0
"""Prior standard deviation of the parameters that a calibration estimates, in typical
sizes: 9 m/s^2 of bias, so that the prior has no influence on the estimate."""

GYRO_COUPLING_SIZE = 2.5
"""The same for the cross-coupling of gyroscopes: 0.05, which no gyroscope exceeds. Two
turns do not determine all of it; the rest widens the scale factors' intervals."""

INSTABILITY: Array = np.repeat([1e-3, 3e-5], 3)
"""Typical scatter of a bias from window to window: 0.1 mg, 6 deg/h."""

CLOSURE_RAD = 5e-4
"""Typical scatter of the closure of a turn beyond the noise, rad: bandwidth, timing and
the hand make half a milliradian."""

FILTERED_S = 0.1
"""Standard deviation of the time constant of a filter of the sensors, s: 1.6 Hz. Data
sheets have 5 to 260 Hz; where turns do not show it, scale factors are less certain."""

FLICKER: Array = np.repeat([2e-3, 1e-4], 3)
"""Typical flicker noise: where Allan deviations of consumer grade stay level, 0.2 mg
and 20 deg/h."""

LARGEST_FLICKER = 10.0
"""Flicker in typical instabilities beyond which a wander has another cause: of 1 mg and
60 deg/h, five times what is typical of consumer grade."""

FLICKER_CHANCE = 0.1
"""Probability that the larger part of a bias's wander is flicker, which neighbouring
windows share, and not an offset that is new in each window."""

AXES_LOG_SPREAD = 0.3
"""Spread of the instabilities of a triad's axes, ln: they are of the same make."""

UNKNOWN: Array = np.repeat([2e-2, 1e-3], 3)
"""Typical size of a function that no effect makes: as of effects."""

HALF_WAVES = (1.5, 4.0, 9.0, 20.0)
"""Half waves of a smooth course over the session, from slow to fast."""

SETTLED_S = 1e4
"""Time since a turn from which nothing changes any more, s: nearly three hours."""

NOISE_SLOPE = 1.0
"""Typical change of ln P of noise in a factor e of frequency: flicker makes 1, a walk
2."""

NOISE_AXES_LOG_SPREAD = 0.5
"""Spread of ln P among the axes of a triad, but for how loud each is: made alike."""

STEADY_HAND_K, WALKING_HAND_K = 2.0, 15.0
"""k of a hand that does not drift, and of one that does as a random walk, with its
standard deviation from one hand to the next (`rows.hand_drift`)."""

SAMPLE_ARRIVAL_S, RATE_ERROR = 0.1, 1e-3
"""Uncertainty of the time between two samples, s, as a host may stamp them late, and of
the rate of samples as a part of it: it changes with the temperature."""

BESIDE_TILT_DEG = 0.05
"""Possible tilt of the base if offsets of the joints explain the positions, or offsets
of the joints if a tilt does, deg. A bubble level does not show less."""

SCALE_WARMING = 0.25
"""Change of an accelerometer's scale factor with the temperature, at 1 g, as a part of
the change of its bias: 0.02 %/K and 0.8 mg/K in the data sheet of the MPU-6050."""

MISSET_DEG = 3.0
"""Typical error of a position whose angle is not the stated one, deg."""

SINGLE_MISTAKE_DEG, REPEATED_MISTAKE_DEG, GAUGE_ERROR = 10.0, 0.2, 5e-3
"""Typical error of one position, deg, of an angle that is set several times, deg, and
of a gauge that all angles come from, as a part of them."""

LEAN_CHANCE, LEAN_RAD = 0.1, 2e-4
"""Probability that the support of a device gives way while it rests, and typical angle,
rad: tyres, foam and grass yield by tenths of a milliradian in a minute."""

STOP_SETTLING_CHANCE, STOP_SETTLING_RAD = 0.01, 1e-3
"""Probability that a device goes on turning for seconds after it was put down, and
typical angle, rad: foam, a hand that lets go, the joints of a fixture."""

SINK_CHANCE, SINK_RAD, SINK_FADING = 0.02, 5e-4, 0.2
"""Probability that the base of a fixture turns during the session, typical angle, rad,
and ratio of each polynomial to the one before: a tripod on soil or a bending table
settles with time constants from one to several times the session."""

LOST_TURN_CHANCE, LOST_TURN_RAD = 0.02, 0.03
"""Probability that the gyroscopes did not measure the whole of a turn, and the typical
missed angle, rad: a tenth of a second of a turn by hand."""

ARRIVAL_S = 0.3
"""Standard uncertainty of the instant at which a turn by hand ends."""

BUILD_UP_ON_WAY, BUILD_UP_AT_END, BUILD_UP_S = 0.5, 0.15, 2.0
"""Uncertainty of how a settling effect builds up, in its size: during the turn and at
its end, and the correlation time of that error, s. Judged, not measured: how an effect
develops during a turn is not known."""

CLOCK_S, CLOCK_RATE = 1e-2, 1e-4
"""Typical error of an alignment by correlation, s, and of a quartz, 1."""

AXES_TURNED = 0.1
"""Typical rotation between two sets of axes that are taken as the same, rad."""

UPRIGHT, UNSEEN = 10.0, np.repeat([0.5, 0.01], 3)
"""Possible offset of a channel that the reference does not measure: gravity along the
upright axis, and three degrees of it along the level axes."""

REFERENCE_NOISE_CHANCE = 0.5
"""Probability that a triad of a reference has noise of its own: a better sensor has,
and simulators may."""

SMALL_ROTATION = 1.0
"""Prior standard deviation of the rotations of an unknown orientation, rad: any."""

LOOSE_FIXTURE_CHANCE, LOOSEST_FIXTURE = 0.2, 100.0
"""Probability that the windows of a given set scatter for another reason than the
device (a fixture that does not return, an effect that is left out), and by how many
typical instabilities at most: 0.1 m/s^2, a joint that returns to half a degree."""

BAD_WINDOW_CHANCE = 5e-3
"""Probability that a given window is disturbed without showing it."""

COMPANION_CHANCE = 0.3
"""Probability of an effect in one triad if the other triad has it, and of an error of
uncalibrated devices if another of these errors is present. Judged: many causes, such as
a power-on or a temperature, act on both triads, and many do not."""

SINGLE_AXIS_SHARE = 0.1
"""Part of the random walks that are those of a single axis. Judged: the axes of a triad
are of the same make."""

WRONG_LATITUDE_CHANCE = 1e-3
"""Probability that a stated latitude is wrong."""

RESTART_CHANCE = 0.1
"""Probability that an effect with an instant begins where samples are missing between
two positions, by itself: what was knocked or set up anew meanwhile, or one triad."""

RESTART_SIZES = SIZES[[14, 17, 20]]
"""Sizes of the jumps of a restart, in typical ones, equally likely: 0.03 to 1. Data
sheets state turn-on repeatabilities of 0.1 to 5 mg, and of 10 to 400 deg/h."""

BOTH_RESTART_ODDS = 20.0
"""Odds that all axes of a triad have changed there by such amounts, if those of the
other triad have; the inverse for some axes. Judged: after a restart every bias is
another one. A restart has odds of 2 with it, before rows are looked at: a link fails as
often, but a wrong bias costs more than one position."""

AS_STATED_CHANCE = 0.2
"""Probability that a kind of error is as small as in the stated grade, if the biases
are those of a coarser grade: the gyroscopes say little of the accelerometers."""

UNKNOWN_FUNCTION_CHANCE = 5e-4
"""Probability of a function that no effect makes, for each covariate: one in twenty of
the probability of an effect."""


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


@cache
def log_density(largest: float = np.inf) -> Array:
    """Log prior of each of `SIZES`; beyond `largest` it falls as instability's too."""
    out: Array = np.log(density()) - np.log1p((SIZES / largest) ** INSTABILITY_TAIL)
    return out
