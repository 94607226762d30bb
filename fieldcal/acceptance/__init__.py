"""GO or NO-GO: whether a calibration is good enough to be used, with reasons.

`decision` makes all checks, each a function that returns a `Check`: its own, and those
of `uncertainty`, `change` and `conditions`; `assessment` gathers what they need from a
session and its history. Nothing here estimates or changes a parameter.
"""
