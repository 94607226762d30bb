"""The contents of a diagnosis, made from the explanation of the recording.

Effects with values and ±, mismatches, rejected candidates, residuals before and after:
each module makes one part of `result.Diagnosis`. Sentences are made in `wording`.
"""
