"""What happens to samples: faults of the signal chain, and lines of the spectrum.

Each is found in the samples themselves, before they are averaged, and is corrected,
left out or subtracted. Nothing here knows the model or what the recording is laid to.
"""
