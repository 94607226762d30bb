"""What physics a simulation leaves out of a recording.

Samples are checked (`chain`), cleaned of lines (`spectrum`) and reduced to block means
(`reduce`); windows and the turns between them are laid to causes of the catalogue by
one model (`fieldcal.model`, `explain`), and `verdict` puts it together.
"""

from fieldcal.diagnosis.result import Diagnosis
from fieldcal.diagnosis.verdict import diagnose

__all__ = ["Diagnosis", "diagnose"]
