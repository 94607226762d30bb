"""Calibration of a device at one temperature, independent of installed parameters.

An autopilot sends U = (r - o) k of its sensor's output r, and U = b + M f was found, so

    r = (o + b / k) + (M / k) f                        a row of M by its own k      (1)

which does not depend on what the autopilot had installed. Temperatures are in deg C, by
the thermometer of the device.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.names import ParameterName
from fieldcal.core.errors import InputError
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import parameter_names

TRIAD_OF_GROUP = {"cross_coupling": "acc", "gyro_cross_coupling": "gyr"}


@dataclass(frozen=True, slots=True)
class ThermalPoint:
    """Calibration of the sensor's own output, and the temperature of the device.

    Attributes
    ----------
    name : of the session, for messages
    temperature : to which the values belong, deg C
    temperature_sd : standard deviation of the temperature in the session, K
    calibration : of the sensor's own output, (1)

    """

    name: str
    temperature: float
    temperature_sd: float
    calibration: Calibration


def thermal_point(name: str, found: Calibration) -> ThermalPoint:
    """Make a thermal point of a calibration.

    Raises
    ------
    InputError
        If the calibration has no temperature, is bad, or was found with the
        autopilot's temperature correction enabled.

    """
    if not found.good:
        raise InputError(
            f"{name}: the calibration is bad; leave it out, or record it again"
        )
    conditions = found.info.get("conditions", {})
    warm = found.info.get("carried", {}).get("as_of", {}).get("temperature_degc")
    temperature_sd = (
        0.0 if warm is not None else conditions.get("temperature_sd_k") or 0.0
    )
    warm = conditions.get("temperature_degc") if warm is None else warm
    if warm is None:
        raise InputError(
            f"{name}: the device told no temperature; record from an output that has"
            " one, or import with --columns … temperature"
        )
    return ThermalPoint(
        name, float(warm), float(temperature_sd), _own_output(name, found)
    )


def _own_output(name: str, found: Calibration) -> Calibration:
    """Calibration of the sensor's own output, (1)."""
    table: Any = found.info.get("installed")
    if not table:
        return found
    there = InstalledCalibration.from_table(table)
    corrects = [n for n, v in there.values.items() if n.endswith("_ENABLE") and v]
    if corrects:
        raise InputError(
            f"{name}: {corrects[0]} was {there.values[corrects[0]]:g}, so the autopilot"
            " had corrected for temperature already; set it to 0, and record again"
        )
    now = there.parameters_after(np.zeros(3), np.ones(3), np.zeros(3))
    known = parameter_names(there.autopilot, there.instance)
    o = {s: [now[n] for n in known[f"{s}_offset"]] for s in ("acc", "gyr")}
    k = {"acc": [now[n] for n in known["acc_scale"]], "gyr": [1.0] * 3}
    more: np.ndarray[Any, Any] = np.zeros(len(found.names))
    per: np.ndarray[Any, Any] = np.ones(len(found.names))
    for i, parameter in enumerate(map(ParameterName.of, found.names)):
        sensor = parameter.sensor or TRIAD_OF_GROUP.get(parameter.group)
        if sensor is None:
            continue
        row = parameter.axis if parameter.sensor else parameter.entry[0]
        per[i] = k[sensor][row]
        more[i] = o[sensor][row] if parameter.group.endswith("_bias") else 0.0
    return replace(
        found,
        values=found.values / per + more,  # (1)
        covariance=found.covariance / np.outer(per, per),
    )
