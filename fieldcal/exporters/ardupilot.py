"""ArduPilot parameters, a .param file: raw -> true.

ArduPilot corrects a sample r of a sensor, axis by axis in the sensor's own frame,

    accelerometer  f = (r - INS_ACCOFFS) INS_ACCSCAL                               (1)
    gyroscope      w = r - INS_GYROFFS                                             (2)

and rotates it by AHRS_ORIENTATION afterwards. fieldcal has U = b + s f (true -> raw),
so INS_ACCOFFS = b with the same sign, and INS_ACCSCAL = 1 / s. If the autopilot applied
a calibration to U already, both are combined, see `mavlink_installed`. The parameters
do not include cross-coupling and gyroscope scale; a notice states the resulting error.

Units: m/s^2, rad/s. Sources: ArduPilot's parameter list, INS_*; AccelCalibrator.cpp and
accel_calibrated_ok_all in AP_InertialSensor.cpp.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fieldcal.calibration import Calibration, Nominal
from fieldcal.calibration.diagonal import DiagonalCalibration, reduce_to_diagonal
from fieldcal.calibration.names import sensor_of
from fieldcal.core.errors import InputError
from fieldcal.drivers.mavlink_installed import InstalledCalibration, identity_parameters
from fieldcal.drivers.mavlink_parameter_names import (
    ARDUPILOT,
    GYRO_CAL_AT_START,
    check_number,
    parameter_names,
    replaced_at_start,
)
from fieldcal.exporters import ExportSource
from fieldcal.session.file_writing import write_atomically

WHAT = "ArduPilot parameters (INS_ACCOFFS, INS_ACCSCAL, INS_GYROFFS)"
ENDING = ".param"

WRITTEN = ("acc_bias", "acc_scale", "gyr_bias")
"""Groups that autopilots have parameters for."""

LARGEST_OFFSET, LARGEST_SCALE_ERROR = 3.5, 0.2
"""Range of an offset, m/s^2, and of a scale about 1 in ArduPilot's parameter list."""


class ArdupilotParameters(NamedTuple):
    """Parameters to install, with notices for the user.

    Attributes
    ----------
    values : by name
    notices : about omitted parameters and the resulting errors, one sentence each

    """

    values: Mapping[str, float]
    notices: tuple[str, ...]


def parameters(
    calibration: Calibration,
    nominal: Nominal | None = None,
    installed: InstalledCalibration | None = None,
    instance: int = 0,
) -> ArdupilotParameters:
    """Return the parameters by which ArduPilot corrects the sensor.

    Parameters
    ----------
    calibration : U = b + M f of the samples as recorded
    nominal : values of parameters that were not determined
    installed : calibration that the autopilot applied to U; None for raw samples
    instance : number of the sensor, from 0, if `installed` does not state it

    Raises
    ------
    InputError
        If `installed` is incomplete, of another program, or of a rotated board; if
        the program has no such sensor; or if neither biases nor scales were determined.

    """
    found = autopilot_parameters(ARDUPILOT, calibration, nominal, installed, instance)
    return ArdupilotParameters(
        found.values, (*found.notices, *_as_ardupilot_judges(found.values))
    )


def _as_ardupilot_judges(values: Mapping[str, float]) -> Iterator[str]:
    """Sentences about values that ArduPilot does not take for a calibration's.

    Its own calibration has none outside of the range of its list, and to its check
    before arming an accelerometer with the offsets 0, 0, 0 is not calibrated.
    """
    offsets = {n: v for n, v in values.items() if "ACC" in n and "OFFS" in n}
    scales = {n: v - 1 for n, v in values.items() if "SCAL" in n}
    for some, most in ((offsets, LARGEST_OFFSET), (scales, LARGEST_SCALE_ERROR)):
        for name in (n for n, off in some.items() if abs(off) > most):
            yield (
                f"{name} = {values[name]:.4g} is outside of the range in ArduPilot's"
                " parameter list: check the unit of the recording"
            )
    if offsets and not any(offsets.values()):
        yield (
            f"{', '.join(offsets)} are 0: ArduPilot takes that for an accelerometer"
            " that was never calibrated, and does not arm; determine acc_bias"
        )


def autopilot_parameters(
    autopilot: int,
    calibration: Calibration,
    nominal: Nominal | None,
    installed: InstalledCalibration | None,
    instance: int,
) -> ArdupilotParameters:
    """Return offsets and scales for an autopilot that corrects by (1) and (2)."""
    if installed is not None and installed.autopilot != autopilot:
        raise InputError(
            "the recording has the calibration of another autopilot program taken "
            "out: export the format of that program"
        )
    device = installed or _nothing_installed(autopilot, instance)
    check_number(autopilot, device.instance)
    start = nominal or Nominal()
    start = start if installed is None else installed.nominal(start)
    acc, gyr = (
        reduce_to_diagonal(calibration, sensor, start) for sensor in ("acc", "gyr")
    )
    every = device.parameters_after(acc.bias, acc.scale, gyr.bias)
    known = parameter_names(autopilot, device.instance)
    kept: list[str] = []
    groups = set(calibration.groups)
    if groups & {"acc_bias", "acc_scale"}:
        kept += [*known["acc_offset"], *known["acc_scale"]]
    if "gyr_bias" in groups:
        kept += known["gyr_offset"]
    if not kept:
        raise InputError("the calibration has neither biases nor scales to install")
    says = [
        *_left_out_notices(calibration, acc, gyr),
        *_undetermined_notices(
            calibration, installed is not None and installed.taken_out
        ),
    ]
    return ArdupilotParameters({name: every[name] for name in kept}, tuple(says))


def _nothing_installed(autopilot: int, instance: int) -> InstalledCalibration:
    """Return an autopilot without an installed calibration."""
    nothing = InstalledCalibration(autopilot, instance, {}, taken_out=True)
    known = parameter_names(autopilot, instance)
    nothing.values = {name: 0.0 for some in known.values() for name in some}
    nothing.values |= identity_parameters(nothing)
    return nothing


def _left_out_notices(
    calibration: Calibration, acc: DiagonalCalibration, gyr: DiagonalCalibration
) -> list[str]:
    says = []
    if (worst := float(acc.cross_coupling_error.max())) > 0:
        says.append(
            "cross_coupling has no place in these parameters: leaving it out makes "
            f"errors up to {worst * 9.80665:.3g} m/s^2 at 1 g"
        )
    scale = np.abs(1 / gyr.scale - 1)
    if "gyr_bias" in calibration.groups and (worst := float(scale.max())) > 0:
        says.append(
            "gyr_scale has no place in these parameters: leaving it out makes errors "
            f"up to {worst:.3g} of the rate"
        )
    if (worst := float(gyr.cross_coupling_error.max())) > 0:
        says.append(
            "gyro_cross_coupling has no place in these parameters: leaving it out "
            f"makes errors up to {worst:.3g} of the rate"
        )
    return says


def _undetermined_notices(calibration: Calibration, known: bool) -> Iterator[str]:
    """Sentences about what was not determined; `known` if the installed one stays."""
    instead = "the installed one stays" if known else "the nominal one is used"
    written = {sensor_of(group) for group in calibration.groups if group in WRITTEN}
    for group in WRITTEN:
        lacking = [a for a in "xyz" if f"{group}.{a}" not in calibration.names]
        if not lacking:
            continue
        what = group if len(lacking) == 3 else f"{group} {', '.join(lacking)}"
        then = instead if sensor_of(group) in written else "not written"
        yield f"{what} was not determined: {then}"


def write(source: ExportSource, path: Path) -> list[str]:
    """Write the file; returns notices for the user."""
    found = parameters(
        source.calibration, source.nominal, source.installed, source.instance
    )
    says = list(found.notices)
    if "gyr_bias" in source.calibration.groups:
        told = source.installed.values if source.installed else {}
        number = source.installed.instance if source.installed else source.instance
        says += replaced_at_start(number, told.get(GYRO_CAL_AT_START))
    lines = [
        "# fieldcal: true = (raw - OFFS) * SCAL, m/s^2 and rad/s, sensor axes",
        *(f"# {sentence}" for sentence in says),
        *(f"{name},{value:.9g}" for name, value in found.values.items()),
    ]
    write_atomically(path, "\n".join(lines) + "\n")
    return says
