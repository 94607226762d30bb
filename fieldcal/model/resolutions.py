"""Resolutions: how finely time, sizes, angles and frequencies are divided.

A finer division takes longer; a coarser one loses what its reason names. In a session
of nine positions and one by hand, half or double of `TARGET_ROWS`, `POLYNOMIALS` or
`WAY_MEAN_S` moves no value by 0.1 standard deviations, no deviation by 5 % and no
probability by 0.02.
"""

from __future__ import annotations

# -- rows

TARGET_ROWS = 360
"""Rows aimed at, over all windows."""

MIN_WINDOW_ROWS, MAX_WINDOW_ROWS = 8, 120
"""Rows of one window: courses have eight at least, and one window two minutes."""

FIRST_ROW_S = 1.0
"""Length of the first row of a window, in which settling changes fastest, s."""

INTEGRAL_STEP_S = 0.05
"""Step at which the integral of the outputs is kept, s: in it a turn by hand changes
them evenly."""

KNOTS_PER_ROW = 4
"""Knots in each row of the reference's mean over a row, if it has as many samples: what
is left after that mean is smooth between them."""

RECORDING_PARTS = 8
"""Parts of a recording, of whole stretches, that something may happen to."""

QUADRATURE_NODES = 48
"""Of the integral of a cubic from one instant to the next, times the exponential of a
filter: exact for a polynomial of degree 95."""

# -- turns

INTEGRATION_STEP_S = 0.02
"""Step of the integration, s; one sample where samples come less often. With half or
double, standard deviations of the cross-coupling of gyroscopes change by up to 22 % in
a recording by hand, and values by less than 0.2 of them."""

WAY_MEAN_S, MAX_WAY_MEANS = 0.15, 60
"""Length of the means of the accelerometers during a turn, s, and their largest number:
a turn of ten seconds has them all."""

ACCELERATION_MEAN_S = 0.1
"""Length of the means of the rate whose derivative is the angular acceleration, s."""

ROTATION_STEP_S = 0.1
"""In which a rotation is added to the way of a base that sways, s."""

# -- courses in time, and over angles

COSINES, MAX_COSINES = 40, 80
"""Cosines of a smooth course, and the most of a random walk or of flicker, which have
as many as a smooth one at least. The prior of the fastest smooth course makes further
ones negligible; 80 are one for some seconds of a session of minutes, and what they
leave of a random course is nearly white."""

STOP_SETTLING_S = (1.0, 2.0, 5.0, 12.0)
"""Time constants of a device that goes on turning after it was put down, s. Their sum
follows one of 1 to 12 s to within 2 % of its start, from a quarter of a second on."""

COSINES_PER_VISIBLE = 2.0
"""Cosines used over those that exceed the noise of the rows each."""

MIN_COSINE_SIZE = 1e-3
"""Relative size below which a cosine is omitted from a course: a millionth of its
variance."""

POLYNOMIALS = 4
"""Legendre polynomials of what changes slowly during a session: an angle of the base,
or the share of a force in time."""

HARMONICS = 4
"""Harmonics of an angle; an effect of its fourth power has four."""

# -- sizes

VALUES_PER_SIZE = 4
"""Values of v for each of `priors.SIZES` where a random walk and flicker are told
apart: 15 % from one to the next."""

REFINED_SIZES = 129
"""Sizes that are tried between the neighbours of one of `priors.SIZES`: 1 % each."""

INSTABILITY_STEPS_DOWN = (3, 6, 9, 40)
"""Steps of `priors.SIZES` by which the instability may decrease when a cause explains
it: by factors of 6, 32 and 180, and to the smallest size."""

CLOSURE_STEPS_UP = (1, 5)
"""Steps above the typical size to which the instability of closures may rise when that
of the accelerometers decreases, since errors of closures come from both:
by 1.8 and 18."""

FLICKER_STEPS_DOWN = (1, 2)
"""Steps of `priors.SIZES` by which the size of flicker may decrease when a cause
explains it: at its full size, flicker explains most of a random walk."""

GRID_STEP_DEG = 15.0
"""Step of the angles that are tried for a position far from those that are stated; half
of it is within `thresholds.CONVERGES_WITHIN_RAD`."""

# -- what is held out, or averaged

STRETCHES_PER_WINDOW = 24
"""Parts of each window that are held out if there are too few windows. They are short,
since random processes predict for a short time only."""

LINE_STRETCHES_PER_WINDOW = 5
"""The same where a line is predicted: each has many of its periods."""

PART_ENDS = (0.0, 0.1, 0.25, 0.5, 1.0)
"""Ends of the parts of a window over which residuals are averaged, of it: most of what
settles does so first."""

# -- frequencies

PERIODOGRAM_SAMPLES = 1 << 15
"""Samples of one periodogram: 5 min at 100 Hz."""

LEVEL_PERIODOGRAMS = 200
"""Periodograms whose mean gives the level of noise, to 7 %."""

GRID_PER_SAMPLE = 4
"""Grid points per sampling period for samples at uneven times: an error of an eighth of
a period costs 3 % of the power at most below 0.4 of the rate, one of a half a third."""

PARTS_PER_WINDOW, MIN_PART_SAMPLES = 15, 4
"""Parts per window (or per length of a periodogram) whose sums are kept, so that the
frequency can be shifted within a periodogram's resolution; fewest samples in a part."""

BAND_RATIO, MIN_BAND_COEFFICIENTS = 1.25, 5
"""Of the ends of a band of noise, and coefficients of one at least, whose power is then
known to 60 %."""

KNOTS_HZ = 200.0
"""Least knots a second of a reference: a spline through them keeps all but 3e-4 of the
25 Hz that rows show at most."""

SERIES_REACH, SERIES_WINDOW = 48, ("kaiser", 14.0)
"""Samples to each side that such knots are made of, and their window: up to 0.45 of the
samples' rate a wave is kept to 1e-6."""

POWER_PIECE_S, POWER_REACH = 5.0, 2
"""Length of the pieces that give the power of a motion, s, and frequencies to each side
over which it is averaged at least: a piece's window spreads a line over as many."""

CENTRE_EVERY = 10
"""Samples of the first window of which one is looked at for what is subtracted from
all, to keep the rounding of their sums small: any number near their mean does."""

# -- the temperature

VALUE_HALF_SPANS_S = (12.0, 8.0, 5.0, 3.0)
"""Half spans of the line for the value, s, the longest first; where each of them
flattens the course, the means themselves are taken."""

RATE_HALF_SPANS_S = (6.0, 10.0, 16.0, 25.0, 40.0)
"""Half spans of the line for the rate, s: a longer one has less noise, and flattens
what changes faster than it."""
