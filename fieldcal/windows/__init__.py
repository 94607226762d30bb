"""From samples to averages: mean, honest standard error, stillness, disturbance.

This package has the only measurement of white noise and rounding. It knows no
positions, parameters or files.
"""

from fieldcal.windows.limits import StillnessLimits
from fieldcal.windows.mean import Average
from fieldcal.windows.pieces import PiecedWindow
from fieldcal.windows.stillness import Stillness
from fieldcal.windows.stretches import still_stretches
from fieldcal.windows.window import LearnedNoise, Window, average

__all__ = [
    "Average",
    "StillnessLimits",
    "LearnedNoise",
    "PiecedWindow",
    "Stillness",
    "Window",
    "average",
    "still_stretches",
]
