"""Detections: from when samples show that something is there, each with its reason.

What is said of it then is decided by `thresholds`; how large it is usually is in
`priors`.
"""

from __future__ import annotations

import math

# -- enough samples

MIN_SAMPLES = 8
"""Samples of a channel or of a slope, steps of a turn, or differences from which
anything is told: their noise is known to a quarter."""

MIN_WINDOW_SAMPLES = 20
"""Samples of a window that is used; a shorter one is told to the user."""

MIN_LINE_SAMPLES = 64
"""Samples of a window that is searched for lines: 32 frequencies."""

# -- the device moves

MOTION_MEAN_S, ONSET_SIGMAS = 0.2, 7.0
"""Length of the means that are compared with that of a window, s, and difference in
standard errors that is motion: one in 4e11 by chance, of hundreds of means of outputs
whose noise is not quite white."""

MAX_REST_RATE, MAX_REST_FORCE = 2e-3, 0.05
"""Differences that are never motion, however low the noise, rad/s and m/s^2."""

TURN_MEAN_S, MIN_MOTION_RATE, MOTION_SIGMAS = 0.1, 3e-3, 8.0
"""Length of a mean of the rate, s, and its limit of motion: rad/s, and standard
deviations by noise, whichever is more."""

MIN_MOTION_RATIO = 2.0
"""Ratio of the largest rate to the limit of motion. Below it the motion cannot be
located, and the whole gap between the windows is integrated."""

BELONGING_S, MOTION_MARGIN_S = 5.0, 0.6
"""Time before and after a motion in which smaller motions are looked for, and which
belongs to the integrated turn, s."""

MAX_TURN_S, MIN_TURN_RAD = 60.0, math.radians(1.0)
"""Longest turn that is integrated, s, and smallest that is used, rad."""

MAX_STEP_PART = 0.99
"""Distance from the value in the windows, in steps, below which an output counts as
that value: a mean between two values of the grid is less than one step from both."""

WINDOW_EDGE_S = 10.0
"""Part of a window next to a turn in which sway is measured, s."""

# -- a hand holds the device

MIN_HELD_WINDOWS = 4
"""Windows of a device in a hand; what lies still for long drifts by itself."""

QUIET_SHARE = 0.25
"""Share of the windows that show no more than the sensors' own noise."""

LYING_NOISE_RATIO = 3.0
"""Times that noise which one shows in which the device lies still: in published
recordings 2 at most on a table, 4 to 60 in a hand."""

HELD_RATIO = 1.5
"""Times their quickest noise that accelerometers show where a hand pushes the device:
on a table that trembles 1.3 at most in published recordings. And times the squares
along the force that those across it have where its angle wanders."""

# -- the base sways

MIN_SWAY_RAD = math.radians(0.2)
"""Turning from which it is taken out, rad. What is less moves gravity by less than 3e-5
m/s^2 in the mean, and is a line as any other where it is regular."""

MIN_SWAYING_SHARE = 0.5
"""Part of the windows that must sway: a base does not sway in one of them alone."""

WINDOW_MARGIN_S = 0.03
"""Before a window in which the way may end already, s: its steps are as long."""

# -- a table turns the device

MIN_REVOLUTIONS = 1.0
"""Whole turns of a window from which what goes round is told from the mean."""

MIN_AXES_SPREAD = 1e-3
"""Least singular value, of the largest, from which axes of rates tell a bias."""

MIN_EARTH_POSITIONS, MAX_EARTH_MISFIT = 6, 0.2
"""Positions from which the Earth's rate is sought in them, and share by which what is
left then may be longer or shorter: beyond, directions are not known well enough for
what is linear about them."""

# -- the device was restarted, or a bias jumped

MIN_GAP_S, MIN_GAP_PERIODS = 0.5, 5.0
"""Time, and periods of the samples, without any in which a device may restart."""

COUNTERS = (2.0**8, 2.0**16, 2.0**32)
"""Numbers that a counter of samples may have before it begins again."""

PAUSE_INTERVALS = 3.5
"""Intervals between knots, or samples, from which there is a pause."""

ROWS_BESIDE_JUMP = (1, 2, 4, 8)
"""Rows on either side: a jump amid flicker shows best in some of them."""

CLEAR_JUMP_SIGMAS = 16.0
"""Standard deviations of the difference, by the scatter beside it, of a clear jump: a
sine of any frequency comes to 12.7 at most, a ramp to 7.9."""

# -- a bias wanders

DIFFERENCE_LAGS = (1, 3, 9)
"""Distances between neighbouring means of a second difference, in rows: the
variance of a walk triples from one to the next, that of flicker hardly grows."""

SQUARE_MEDIAN, MEDIAN_LOG_SCATTER = 0.4549, 2.7
"""Median of chi-squared with one degree of freedom; standard deviation of the log of a
sample median over it, times the square root of the number of values."""

WALK_SLOPE, SLOPE_REACH = 2.0, 1.5
"""Slope of ln P of a walk, the steepest that is continued to lower frequencies, and how
far beyond the lowest slopes are told by, in ln of it."""

# -- a filter, or a delay

MIN_TIME_CONSTANT_S = 2e-3
"""Time constant of first order that hardly a motion of a body tells from a delay, s."""

MIN_SECOND_ORDER_S = 0.015
"""The same of second order, s: what tells it from a delay is a part (w tau)^3 / 2 of a
motion at w, 7e-4 of one at 1 Hz."""

# -- the temperature changes

MIN_WARMING_K, WARMING_SIGMAS = 0.1, 6.0
"""Change that a thermometer must show to have shown one, K, and standard deviations of
its own noise, whichever is more."""

MAX_VALUE_MISFIT = 1.3
"""Times the noise of the means that a line may leave of them; more is flat."""

MAX_RATE_NOISE = 0.05
"""Noise of the rate, of the rate's spread, that is allowed."""

MAX_RATE_DIFFERENCE = 1.5
"""Noise of the shorter span's rate that a longer one's may differ by; more is flat."""

# -- a window vibrates

NOISIER_SIGMAS = 6.0
"""Standard deviations from which a window counts as noisier than the others."""

LINE_POWER_RATIO, LOWEST_VIBRATION_HZ = 30.0, 2.0
"""Power of a line in a noisy window, in those of its neighbours at the median. What
is slower may be the sensors' own."""

# -- a line is in all windows

MIN_CYCLES, LOWEST_LINE_HZ = 2.5, 0.05
"""Fewest cycles in a window that make a line, and the lowest frequency of one, Hz: what
is slower is a course in time."""

SLOPE_PERIODS = 30.0
"""Periods in a window up to which a slope takes a part of a line: 0.07 % here."""

LINE_DISTANCE_CYCLES = 2.0
"""Distance between two lines, in cycles of the shortest window: the reach of a
taper."""

SEARCHED_GROUPS = 16
"""Groups of channels in which a recording is searched for a peak, about."""

PEAK_EDGE_RATIO = 2.0
"""Times the floor down to which the power about a peak belongs to it."""

FLOOR_NEIGHBOURS = 40
"""Neighbours that give the floor, to either side."""

NEAREST_NEIGHBOUR, FURTHEST_NEIGHBOUR = 5, 12
"""Nearest and furthest neighbours beyond the taper's reach; they give the slope."""

STEEP_RATIO, SLOPE_POWER_SHARE = 4.0, 0.3
"""Multiple of the floor above which these neighbours replace it, and part of the power
at a frequency that is below it on a slope; beside a line, less."""

SHORT_STEP, SHORT_STEP_SHARE = 0.5, 0.01
"""Time step, in sampling periods, below which a step cannot be the device's own, and
part of the steps that are so short where times are those of arrival."""

MAX_COHERENT_PERIODS = 1 << 20
"""Longest recording in which a line has one phase, in sampling periods: over longer
pauses no clock keeps the phase of a line."""
