"""What physics a simulation leaves out of a recording.

Samples are checked and cleaned of lines (`signal`) and reduced to block means
(`prepare`); causes of the catalogue explain windows and the turns between them by one
model (`fieldcal.model`, `explain`). `findings` makes the parts of a diagnosis,
`wording` the sentences, and `verdict` puts it together.
"""

from fieldcal.diagnosis.result import Diagnosis
from fieldcal.diagnosis.verdict import diagnose

__all__ = ["Diagnosis", "diagnose"]
