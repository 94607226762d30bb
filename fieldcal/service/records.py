"""A session as a record of a test station, in the manner of OpenHTF.

One phase, whose measurements are the parameters with their ± and the checks of GO and
NO-GO; the outcome is PASS, FAIL, or ERROR where there is no result. Keys are those of
https://github.com/google/openhtf, output of `json_factory`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fieldcal.core.version import __version__
from fieldcal.history.sessions import StoredSession

OUTCOMES = {True: "PASS", False: "FAIL", None: "UNSET"}


def station_record(one: StoredSession) -> dict[str, Any]:
    """The record of a session; values in the parameters' units."""
    result: Mapping[str, Any] = one.result or {}
    decision = result.get("decision", {})
    passed = one.good if one.go is None else one.go
    outcome = "ERROR" if one.result is None else OUTCOMES[bool(passed)]
    measured = {
        name: {
            "measured_value": value,
            "uncertainty": sigma,
            "units": unit,
            "outcome": "UNSET",
        }
        for name, (value, sigma, unit) in one.parameters.items()
    }
    checks = {
        str(check["name"]): {
            "outcome": OUTCOMES[check["ok"]],
            "docstring": str(check["says"]),
        }
        for check in decision.get("checks", [])
    }
    return {
        "dut_id": one.serial or None,
        "station_id": one.levels.get("station"),
        "outcome": outcome,
        "outcome_details": [] if one.error is None else [{"description": one.error}],
        "start_time": one.taken_at,
        "phases": [
            {"name": "calibration", "outcome": outcome, "measurements": measured},
            {"name": "decision", "outcome": outcome, "measurements": checks},
        ],
        "metadata": {**one.levels, "software": f"fieldcal {__version__}"},
    }
