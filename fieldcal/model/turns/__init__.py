"""One turn between two windows: the attitude, integrated from the gyroscopes.

Rotations, their derivatives by bias and scale factor, and the closure of a turn; the
columns of turns are in `model.system`. This package holds kinematics and knows no
causes.
"""
