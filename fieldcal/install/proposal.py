"""Parameters to install on an autopilot after a recalibration, old and new.

    o' = o + b / k,  k' = k / s                            see `mavlink_installed`  (1)
    var o' = var b / k^2,  var k' = k^2 var s / s^4                                 (2)

with o, k what was installed while it was recorded, b, s what was found from that. What
was not determined stays as installed, or is as nominal if the samples have o and k in
them. Units m/s^2, rad/s; device axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration, Nominal
from fieldcal.calibration.diagonal import reduce_to_diagonal
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.session.folder import Session

WIDEST = {"acc_offset": 3.5, "gyr_offset": 0.5}
"""Largest offsets that are one, m/s^2 and rad/s; more is a broken sensor or a slip."""

UNITS = {"acc_offset": "m/s^2", "acc_scale": "1", "gyr_offset": "rad/s"}

SCALES = (0.8, 1.2)
"""Scales that an accelerometer can have; calibrations by autopilots refuse others."""

LEFT_OUT = ("gyr_scale", "cross_coupling", "gyro_cross_coupling")
"""Groups that autopilots have no parameters for."""


@dataclass(frozen=True, slots=True)
class Change:
    """One parameter, as it is and as it is to be.

    Attributes
    ----------
    name : of the parameter
    old, new : values
    sigma : standard uncertainty of the new one; 0 where it stays
    unit : of all three

    """

    name: str
    old: float
    new: float
    sigma: float
    unit: str

    @property
    def significance(self) -> float:
        """The change in standard uncertainties; nan where there is none."""
        return (self.new - self.old) / self.sigma if self.sigma > 0 else np.nan


def installed_in(session: Session) -> InstalledCalibration | None:
    """What an autopilot had installed while a session was recorded; None if nothing.

    Raises
    ------
    InputError
        If the session's marks do not tell it whole.

    """
    marks = [mark for mark in session.marks() if mark.get("event") == "device"]
    states = [mark["installed"] for mark in marks if mark.get("installed")]
    return InstalledCalibration.from_table(states[-1]) if states else None


def changes(
    found: Calibration, nominal: Nominal, installed: InstalledCalibration
) -> tuple[Change, ...]:
    """Every parameter to write, old and new, (1), (2).

    Raises
    ------
    InputError
        If what was installed is not known whole, or the board is mounted turned.

    """
    start = installed.nominal(nominal)
    acc, gyr = (reduce_to_diagonal(found, sensor, start) for sensor in ("acc", "gyr"))
    new = installed.parameters_after(acc.bias, acc.scale, gyr.bias)  # (1)
    k = np.ones(3) if installed.taken_out else installed.vector("acc_scale")
    sigma = {
        "acc_offset": _sigma(found, "acc_bias") / np.abs(k),  # (2)
        "acc_scale": np.abs(k) * _sigma(found, "acc_scale") / acc.scale**2,
        "gyr_offset": _sigma(found, "gyr_bias"),
    }
    known = installed.names
    return tuple(
        Change(name, installed.values[name], new[name], float(s), UNITS[what])
        for what, sigmas in sigma.items()
        for name, s in zip(known[what], sigmas, strict=True)
    )


def _sigma(found: Calibration, group: str) -> Any:
    _, sigma = found.vector(group)
    return np.nan_to_num(sigma)


def unsupported_parameters(found: Calibration) -> tuple[str, ...]:
    """Parameters that the autopilot does not have, a sentence each."""
    return tuple(
        f"{group} stays out: the autopilot has no parameter for it"
        for group in LEFT_OUT
        if group in found.groups
    )


def problems(
    wanted: tuple[Change, ...], installed: InstalledCalibration
) -> tuple[str, ...]:
    """Implausible values, a sentence each."""
    known = installed.names
    said = []
    for change in wanted:
        what = next(w for w, some in known.items() if change.name in some)
        if what == "acc_scale":
            if not SCALES[0] <= change.new <= SCALES[1]:
                said.append(
                    f"{change.name} = {change.new:.4g} is not within {SCALES[0]:g} to"
                    f" {SCALES[1]:g}: check the unit of the recording"
                )
        elif abs(change.new) > WIDEST[what]:
            said.append(
                f"{change.name} = {change.new:.4g} {change.unit} is more than"
                f" {WIDEST[what]:g} {change.unit}: check mounting and gravity"
            )
    return tuple(said)
