"""GO or NO-GO: whether a calibration is good enough to be used, with reasons.

`decision` holds the checks, one function a check; `assessment` gathers what they need
from a session and its history. Nothing here estimates or changes a parameter.
"""
