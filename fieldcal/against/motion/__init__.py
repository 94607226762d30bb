"""Compares a recording in motion with a simulator or sensor that follows the motion.

`alignment` aligns the two by their `correlation` at even instants (`grid`), `coherence`
finds the frequency up to which they agree, and `following` explains the recording by
the model of the diagnosis. `shown_effects`, `free_calibration` and `placed` make the
differences, `proof` predicts held-out stretches, and `comparison` combines them. `held`
decides which recordings are in motion.
"""

from fieldcal.against.motion.comparison import compare_in_motion

__all__ = ["compare_in_motion"]
