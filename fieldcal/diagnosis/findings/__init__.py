"""The contents of a diagnosis, made from what explains the recording.

Effects with values and ±, the places of each mismatch, the candidates that lost, the
residuals before and after: each module makes one part of `result.Diagnosis`. Sentences
are made in `wording`.
"""
