"""Table of the parameters: name, value, sigma, unit; true -> raw.

    U = bias + M f,  M = diag(scale) + cross-coupling                              (1)

as everywhere in fieldcal, so  f = M^-1 (U - bias). The table has the determined
parameters only.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

from fieldcal.calibration.gauge import in_sample_units
from fieldcal.exporters import ExportSource
from fieldcal.session.file_writing import write_atomically

WHAT = "table of the parameters with their sigma and unit"
ENDING = "_calibration.csv"


def write(source: ExportSource, path: Path) -> list[str]:
    """Write the file; returns notices for the user."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["name", "value", "sigma", "unit"])
    found = in_sample_units(source.calibration)
    for name, value, sigma, unit in zip(
        found.names, found.values, found.sigma, found.units, strict=True
    ):
        table.writerow([name, f"{value:.12g}", f"{sigma:.6g}", unit])
    write_atomically(path, text.getvalue())
    says = "raw = bias + M true, M = diag(scale) + cross-coupling, device axes"
    others = ("nominal", "raw is in")  # neither applies to this table
    return [*(s for s in source.notices if not any(o in s for o in others)), says]
