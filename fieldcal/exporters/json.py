"""One JSON object, as ``schemas/export.schema.json`` describes it: raw -> true.

    f = matrix (U - bias),  matrix = M^-1                                          (1)

with fieldcal's U = bias + M f. ``sigma`` is that of each parameter as it was estimated;
``nominal`` names biases and scale factors that were not, ``zero`` the cross-coupling
that was not and is 0 in the matrix. Device axes, m/s^2 and rad/s.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.exporters import ExportSource
from fieldcal.session.file_writing import write_atomically

WHAT = "one JSON object, with a JSON Schema"
ENDING = "_calibration.json"

UNITS = {"acc": "m/s^2", "gyr": "rad/s"}


def document(source: ExportSource) -> dict[str, Any]:
    """Return the content of the file."""
    found = source.calibration
    triads = {
        name: _triad(source, sensor)
        for name, sensor in (("accelerometer", "acc"), ("gyroscope", "gyr"))
    }
    parameters = {
        name: {"value": float(value), "sigma": float(sigma), "unit": unit}
        for name, value, sigma, unit in zip(
            found.names, found.values, found.sigma, found.units, strict=True
        )
    }
    device = source.session.about.device
    return {
        "format": "fieldcal-calibration",
        "version": 1,
        "convention": "true = matrix (raw - bias)",
        "device": {k: str(device[k]) for k in ("name", "serial") if k in device},
        "verdict": "good" if found.good else "bad",
        "method": found.method,
        **triads,
        "parameters": parameters,
        "nominal": source.undetermined,
        "warnings": list(found.warnings),
        "zero": source.zero_couplings,
        "notes": source.matrix_notices,
    }


def _triad(source: ExportSource, sensor: str) -> dict[str, Any]:
    bias, matrix = source.linear(sensor)
    return {
        "bias": bias.tolist(),
        "matrix": np.linalg.inv(matrix).tolist(),  # (1)
        "unit": UNITS[sensor],
    }


def write(source: ExportSource, path: Path) -> list[str]:
    """Write the file; returns notices for the user."""
    text = json.dumps(document(source), indent=2, allow_nan=False)
    write_atomically(path, text + "\n")
    return source.matrix_notices
