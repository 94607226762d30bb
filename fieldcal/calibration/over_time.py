"""Text about each parameter against the averaging time, for console and report.

The content is that of `evaluation.nested_windows`, as result.json has it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fieldcal.calibration.wording import format_unit, parameter_title

MAX_SHOWN_TIMES = 5
"""Number of times that are shown: shortest, longest, and evenly between."""

WINS = {
    "fixture": "what fixture and factory leave is more than noise from {} s on",
    "flicker": "flicker or walk is more than white noise from {} s on",
    "drift": "a disturbance or a drift moves them by more than noise from {} s on",
}
"""Text for the error that exceeds noise."""

NOISE = "noise is most of the ±, and longer windows are better"


def heading(told: Mapping[str, Any]) -> list[str]:
    """Names of the columns."""
    seconds = told["seconds"]
    times = [f"{seconds[i]:.3g} s" for i in _shown(len(seconds))]
    return ["parameter", *times, "unit"]


def rows(told: Mapping[str, Any]) -> list[list[str]]:
    """One row for each parameter, with its ± at each time."""
    at = _shown(len(told["seconds"]))
    return [
        [
            parameter_title(name),
            *(f"{one['sigma'][i]:.2g}" for i in at),
            format_unit(one["unit"]),
        ]
        for name, one in told["parameters"].items()
    ]


def sentences(told: Mapping[str, Any]) -> list[str]:
    """Sentences about the error that exceeds noise, and from which time."""
    alike: dict[str, list[str]] = {}
    for name, one in told["parameters"].items():
        wins, what = one["wins"], NOISE
        if wins is not None:
            what = WINS[wins["what"]].format(f"{wins['from_s']:.3g}")
        alike.setdefault(what, []).append(parameter_title(name))
    return [f"{what}: {', '.join(names)}" for what, names in alike.items()]


def _shown(count: int) -> list[int]:
    """Indices of the times that are shown."""
    few = min(count, MAX_SHOWN_TIMES)
    return sorted({round(i * (count - 1) / max(few - 1, 1)) for i in range(few)})
