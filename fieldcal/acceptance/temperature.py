"""Error of an earlier calibration at the present temperature.

Earlier calibrations of the device show how its parameters depend on temperature. If
there are fewer than the model needs, a sentence says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.calibration.wording import parameter_title
from fieldcal.core.errors import InputError
from fieldcal.history.store import HistoryRun
from fieldcal.thermal import ThermalPoint, thermal_model, thermal_point
from fieldcal.thermal.wording import change_document, change_sentences

NEAR_K = 2.0
"""Difference up to which temperatures count as equal, K, as of a room on two days."""


def effect_of_temperature_change(
    calibration: Calibration, earlier: Sequence[HistoryRun], limits: GradeLimits
) -> dict[str, Any] | None:
    """Effect of the change of temperature since the last calibration.

    Parameters
    ----------
    calibration : the present calibration
    earlier : earlier calibrations of the device, oldest first
    limits : limits of its grade

    Returns
    -------
    Temperatures, changes with their ± if the history determines them, and sentences;
    None if the temperature has not changed, or is not known.

    """
    points = [
        p for run in earlier if (p := as_thermal_point(run.taken_at, run.calibration))
    ]
    now = as_thermal_point("now", calibration)
    if now is None or not points:
        return None
    then = points[-1]
    if abs(now.temperature - then.temperature) <= NEAR_K:
        return None
    about = (
        f"{now.temperature:.1f} °C now, {then.temperature:.1f} °C at the calibration of"
        f" {then.name[:10]}"
    )
    out: dict[str, Any] = {
        "now_degc": now.temperature,
        "then_degc": then.temperature,
        "then": then.name,
    }
    try:
        model = thermal_model([*points, now], limits)
    except InputError:
        says = (
            f"{about}: the effect of this change is not known; three calibrations over"
            " at least 10 K show it (fieldcal temperature)"
        )
        return {**out, "parameters": None, "says": [says]}
    changes = model.change(now.temperature, then.temperature)
    told, rest = change_sentences(changes)
    says = f"{about}: the earlier calibration would be off by {'; '.join(told)}"
    if not told:
        says = f"{about}: no parameter changes measurably with it"
    elif rest:
        says += f"; no change is seen in {', '.join(map(parameter_title, rest))}"
    return {**out, "parameters": change_document(changes), "says": [says]}


def as_thermal_point(name: str, calibration: Calibration) -> ThermalPoint | None:
    """A calibration as a point of temperature; None if it has none, or is bad."""
    try:
        return thermal_point(name, calibration)
    except InputError:
        return None
