"""The parameters as a table: name, value, sigma, unit; true -> raw.

    U = bias + M f,  M = diag(scale) + cross-coupling                              (1)

as everywhere in fieldcal, so  f = M^-1 (U - bias). Only what was determined is in it.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

from fieldcal.calibration.gauge import in_sample_units
from fieldcal.exporters import ExportSource
from fieldcal.session.folder import write_atomically

WHAT = "table of the parameters with their sigma and unit"
ENDING = "_calibration.csv"


def write(source: ExportSource, path: Path) -> list[str]:
    """Write the file; what the user must know."""
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
    others = ("nominal", "raw is in")  # none is filled in; raw is as the samples are
    return [*(s for s in source.says if not any(o in s for o in others)), says]
