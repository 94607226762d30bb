"""A recording in motion, held against a simulator or sensor that follows the motion.

`correlation` finds where the two stand beside each other, `following` fits them by the
one model, `proof` predicts stretches that were left out, and `comparison` says what
differs.
"""

from fieldcal.against.motion.comparison import compared_in_motion

__all__ = ["compared_in_motion"]
