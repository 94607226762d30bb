"""Faults of the signal chain, and lines of the spectrum, found in samples.

Each is found in the samples themselves, before they are averaged, and is corrected,
left out or subtracted. Nothing here knows the model or its causes.
"""
