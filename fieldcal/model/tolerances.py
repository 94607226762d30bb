"""Tolerances of the calculation: what bounds its errors, its steps, time and memory.

None of them is meant to decide what is said. How finely things are divided is in
`resolutions`, what decides in `thresholds` and `detections`.
"""

from __future__ import annotations

# -- rounding

ROUNDING = 1e-12
"""Relative size below which a number is the rounding of larger ones: a double has
2e-16, and sums of some thousand terms lose up to four digits."""

ACCUMULATED_ROUNDING = 1e-6
"""The same of what was rounded often, as the logarithm of an evidence, or stamps of
samples in their interval: less of a difference is none."""

SINGULAR = 1e-9
"""Eigenvalue of a matrix of squares, of its largest, below which it is rounding."""

UNDETERMINED = 1e-6
"""Singular value of scaled columns, of the largest, below which rows do not determine a
direction, and eigenvalue of correlations below which they are none: what is measured
has four digits, and what is calculated nine."""

MIN_POWER = ROUNDING**2
"""Power below which a channel repeats its reference, in its unit squared."""

UNEVEN_SHARE = 1e-3
"""Largest distance of stamps from even ones, in their interval, that is taken for
rounding: a microsecond, at up to 1 kHz."""

AXIS_POWER_SHARE = 1e-6
"""Least power on an axis, as a part of that on all three, for an inverse: noise of such
a size takes nothing from a motion that shows."""

NO_WEIGHT_NOISE = 1e5
"""Factor on the noise of a row that must not count: a weight of 1e-10, which no row
shows, and the covariance can still be inverted."""

MIN_VISIBLE_ACC = 1e-6
"""Change of an accelerometer by a column of typical size, m/s^2, below which windows do
not have the column: a tenth of a millionth of gravity, under the noise of any mean."""

MIN_BAND_DOF = 1e-3
"""Degrees of freedom of a band of which columns take all, so that nothing divides by
zero."""

MIN_LOG_FREQUENCY = 0.1
"""Least distance of two bands' frequencies that is counted, ln: bands may coincide."""

MIN_SIZE_INFORMATION = 0.1
"""Least information on ln v: a size that rows do not show still has a width."""

FORGOTTEN_EXPONENT = 40.0
"""Exponent from which a filter has forgotten what was: e^-40 is 4e-18, and a double has
no such digit."""

SAME_VARIANCE = 1e-4
"""Relative difference of variances that is none: the logarithm of an evidence of a
hundred means changes by a thousandth, a twentieth of what a search counts as a rise."""

# -- steps of numerical derivatives

DERIVATIVE_STEP = 1e-3
"""In typical sizes, or m/s^2 and rad/s. Differences are central: their error is the
square, 1e-6, and rounding takes four digits of sixteen."""

ROTATION_STEP_RAD = 1e-5
"""By rotations, rad: a thousandth of the smallest angle that is looked for."""

IMAGINARY_STEP = 1e-30
"""Imaginary step; exact to the machine, since nothing cancels."""

# -- when iterations end

CONVERGED = 0.03
"""Largest step of a column, in its standard deviations, that counts as none: the next
would be its square, a thousandth."""

MIN_SCALE_CHANGE = 0.01
"""Change of a scale factor from which turns are integrated again. The error of
linearisation is its square: 1e-4, and 1e-8 after the last integration."""

MAX_ITERATIONS = 30
"""Of what converges by itself, in little time: steps of a search, of bands of noise and
of a hand's drift. The limit is for rows that contradict themselves."""

MAX_RELINEARISATIONS = 6
"""Steps of Gauss and Newton for one set, and integrations of turns. With 30, nothing
changes in 23 sessions; rows that contradict themselves would take longer."""

MAX_SIZE_ROUNDS = 5
"""Passes over all sizes of a set, each at the others' best. A recording of an
array of sensors reaches the limit: with 30, what is rejected changes there, and what is
named does not."""

MAX_LINEARISATIONS = 8
"""Linearisations of one inference; of sets that alternate, the likelier is kept."""

MAX_RESUMPTIONS = 2
"""Times that a search is resumed from an alias that proved better. With 30, nothing
changes in 23 sessions; each takes as long as a search."""

MAX_CORRECTIONS = 3
"""Iterations of the other errors of gyroscopes; each leaves 1 % of the error."""

FREQUENCY_STEPS = 4
"""Steps of Gauss and Newton to a line's frequency from the highest of a periodogram."""

# -- how many are tried

EVALUATED = 4
"""Of what was ranked by a prediction, the best that are evaluated in full: offers and
pairs at each step of a search, and states about which scores are corrected. With two or
eight, no probability moves by 0.02 in a session of nine positions and one by hand."""

MAX_COMPARED_SETS = 6
"""Sets that are compared again without a part of the rows. With four, the rms of
a prediction changes by 9 % in one channel of a recording at rest."""

PAIRED_CAUSES = 16
"""Causes of which pairs are tried: 120 pairs. With eight, nothing changes in a session
of nine positions and in one by hand."""

MAX_OFFERED_COLUMNS = 60
"""Columns used to predict the gain by a group: three axes of twenty cosines each."""

MAX_ALTERNATIVES = 8
"""Causes that are tried instead of one; further ones are worse."""

PREDICTED_LOSERS = 1
"""Rejected effects whose predictions are calculated: each needs a fit per position."""

MAX_FOLDS = 12
"""Parts that are held out in turn; each is one or several windows, and one more fit."""

MAX_LINES = 4
"""Lines that are looked for in a session."""

MAX_REJECTED_PEAKS = 3
"""Peaks that may turn out to be no line before the search ends."""

MAX_LINES_OF_WINDOW = 8
"""Lines that are taken out of one noisy window: a motor with its harmonics."""

MAX_SUBSET_PARAMETERS = 3
"""Parameters of which all subsets are variants of a cause: seven of three."""

REPRESENTATIVE_POINTS = 24
"""Variants that represent all variants of a certain explanation; the number falls in
proportion to the probability of the explanation."""

PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71)
"""Their square roots spread points evenly over the causes beyond the first; where there
are more causes, over several of them alike."""

# -- time and memory

MAX_NUMBERS = 4_000_000
"""Elements of a table that are calculated at once: 30 MB."""

SAMPLES_AT_ONCE = 1 << 16
"""Samples in which a line is subtracted at once, or looked for in one window."""

FREQUENCIES_AT_ONCE = 256
"""Frequencies tried together: all of a long recording would take much memory."""

MAX_COHERENT_SAMPLES = 1 << 18
"""Samples of a recording that is searched for lines of one phase throughout."""

MAX_TEMPERATURE_MEANS = 3600
"""Means of the temperature of a recording, of a second or longer."""

MAX_COUNTED_PAUSE_S = 60.0
"""What of a pause without samples counts for the width of these means, s."""

UNDIVIDED_SIZE = 64
"""Largest matrix that is inverted without division into halves: smaller ones are in the
processor's cache."""

MIN_TRIDIAGONAL_WIDTH, MIN_TRIDIAGONAL_COLUMNS = 16, 40
"""Width of groups, and columns of all of them, from which tridiagonal matrices are
faster than eigenvalues."""

PIVOTS_PER_LOGARITHM = 8
"""Pivots whose product is in the range of a double: each may be 1e38."""

LAPACK_BLOCK = 32
"""Columns that LAPACK reduces together; its work space is for so many."""
