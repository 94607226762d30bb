"""A recording in motion, held against a simulator or sensor that follows the motion.

`alignment` finds where the two stand beside each other, by their `correlation` at even
instants (`grid`), `coherence` up to which frequency, and `following` fits them by the
one model. `shown_effects`, `free_calibration` and `placed` say what differs, `proof`
predicts stretches that were left out, and `comparison` puts it together. `held` says
which recordings move.
"""

from fieldcal.against.motion.comparison import compared_in_motion

__all__ = ["compared_in_motion"]
