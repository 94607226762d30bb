"""Scale of outputs in volts or counts, and a calibration in their unit.

A device may put out volts or counts U = b + M f. All calculations use outputs u in
m/s^2 and rad/s, before calibration,

    u = U / c,   b_u = b / c,   M_u = M / c                                         (1)

c being volts or counts in one m/s^2 or rad/s by the nominal scale factors. Files hold b
and M of U, in the unit of the samples, and c beside them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.calibration.names import group_of
from fieldcal.calibration.parameters import Calibration
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array

KEY = "gauge"
"""Key in `Calibration.info` if outputs are volts or counts."""

SI = ("m/s^2", "rad/s")

GROUPS = {
    "acc_bias": (0, 0, "m/s^2"),
    "acc_scale": (0, 1, "1"),
    "cross_coupling": (0, 1, "1"),
    "pendulous_products": (0, 2, "1/(m/s^2)"),
    "gyr_bias": (1, 0, "rad/s"),
    "gyr_scale": (1, 1, "1"),
    "gyro_cross_coupling": (1, 1, "1"),
    "gyro_products": (1, 2, "s/rad"),
}
"""Index of the sensor, power of the input that the output is divided by, SI unit."""


@dataclass(frozen=True, slots=True)
class Gauge:
    """Scale of the outputs: their units in one m/s^2 and in one rad/s.

    Attributes
    ----------
    size : c of (1), accelerometers and gyroscopes
    units : units of the outputs

    """

    size: tuple[float, float] = (1.0, 1.0)
    units: tuple[str, str] = SI

    @property
    def is_si(self) -> bool:
        """Whether the outputs are m/s^2 and rad/s."""
        return self.units == SI

    def of(self, group: str) -> tuple[float, str] | None:
        """Factor and unit of a group in the outputs' unit; None if it is in SI."""
        if group not in GROUPS:
            return None
        sensor, power, _ = GROUPS[group]
        size, unit, si = self.size[sensor], self.units[sensor], SI[sensor]
        if unit == si:
            return None
        over = {0: "", 1: f"/({si})", 2: f"/({si})^2"}[power]
        return size, unit + over

    def table(self) -> dict[str, Any]:
        """Return the table of `Calibration.info` and ``result.json``."""
        return {"size": list(self.size), "units": list(self.units)}

    @classmethod
    def read(cls, table: Any) -> Gauge:
        """Read such a table.

        Raises
        ------
        InputError
            If it is not valid.

        """
        try:
            sizes, units = map(float, table["size"]), map(str, table["units"])
            acc, gyr = sizes
            made = cls((acc, gyr), tuple(units))  # type: ignore[arg-type]
            if len(made.units) == 2 and acc > 0 and gyr > 0:
                return made
        except (KeyError, TypeError, ValueError):
            pass
        raise InputError("result.json: gauge is not two sizes above 0 and two units")


def in_sample_units(calibration: Calibration) -> Calibration:
    """The calibration converted to the unit of the samples."""
    return _in_unit(calibration, 1)


def in_si_units(calibration: Calibration) -> Calibration:
    """The calibration converted from the unit of the samples to m/s^2 and rad/s."""
    return _in_unit(calibration, -1)


def _in_unit(calibration: Calibration, power: int) -> Calibration:
    table: Mapping[str, Any] | None = calibration.info.get(KEY)
    if table is None:
        return calibration
    gauge = Gauge.read(table)
    factors: Array = np.ones(len(calibration.names))
    units = list(calibration.units)
    for i, name in enumerate(calibration.names):
        group = group_of(name)
        if (found := gauge.of(group)) is not None:
            factors[i] = found[0] ** power
            units[i] = found[1] if power > 0 else GROUPS[group][2]
    return replace(
        calibration,
        values=calibration.values * factors,
        covariance=calibration.covariance * np.outer(factors, factors),
        units=tuple(units),
    )
