"""What physics a simulation leaves out of a recording.

Samples are checked (`chain`), cleaned of lines (`spectrum`) and reduced to block means
(`reduce`); hypotheses from the catalogue are compared by their evidence (`select`) in
one fit (`fit`), turns between positions tell the rest (`turning`), and `verdict` puts
it together.
"""

from fieldcal.diagnosis.result import Diagnosis
from fieldcal.diagnosis.verdict import diagnose

__all__ = ["Diagnosis", "diagnose"]
