"""Calibration from what a navigator computes, where its sensors cannot be read.

Here live the errors of an inertial navigator at rest (`growth`), its recorded solution
(`solution`), and the estimate of what the sensors' parameters must be for it to have
drifted so (`estimate`).
"""
