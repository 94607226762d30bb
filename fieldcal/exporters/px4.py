"""PX4 parameters, a .params file as QGroundControl loads it: raw -> true.

PX4 corrects a sample r of a sensor (topics sensor_accel, sensor_gyro)

    accelerometer  f = R (r - CAL_ACCn_OFF) CAL_ACCn_SCALE                         (1)
    gyroscope      w = R (r - CAL_GYROn_OFF)                                       (2)

axis by axis in the sensor's frame, and R rotates it into the body frame. Number n is
that whose CAL_ACCn_ID is the sensor's id; without one PX4 uses none. fieldcal has
U = b + s f (true -> raw), so OFF = b with the same sign and SCALE = 1 / s. Samples of
sensor_combined are already corrected by (1); their b and s are combined with the
installed calibration, see `mavlink_installed`.

Units: m/s^2, rad/s. Sources: PX4's parameter reference, CAL_*; Accelerometer.cpp in
its sensor_calibration.
"""

from __future__ import annotations

from pathlib import Path

from fieldcal.calibration import Calibration, Nominal
from fieldcal.drivers.mavlink_installed import InstalledCalibration
from fieldcal.drivers.mavlink_parameter_names import PX4
from fieldcal.exporters import ExportSource
from fieldcal.exporters.ardupilot import ArdupilotParameters, autopilot_parameters
from fieldcal.session.file_writing import write_atomically

WHAT = "PX4 parameters (CAL_ACC, CAL_GYRO), for QGroundControl"
ENDING = ".params"

FLOAT_TYPE = 9
"""Type code of a 32 bit floating point parameter in a parameter file."""


def parameters(
    calibration: Calibration,
    nominal: Nominal | None = None,
    installed: InstalledCalibration | None = None,
    instance: int = 0,
) -> ArdupilotParameters:
    """Return the parameters by which PX4 corrects the sensor.

    Arguments and errors as of `ardupilot.parameters`.
    """
    return autopilot_parameters(PX4, calibration, nominal, installed, instance)


def write(source: ExportSource, path: Path) -> list[str]:
    """Write the file; returns notices for the user."""
    found = parameters(
        source.calibration, source.nominal, source.installed, source.instance
    )
    says = list(found.notices)
    if source.installed is None:
        ids = (f"CAL_{triad}{source.instance}_ID" for triad in ("ACC", "GYRO"))
        says.append(
            f"PX4 takes these for the sensors whose ids {' and '.join(ids)} have: if"
            " they are others, name the sensor's number by --instance"
        )
    lines = [
        "# fieldcal: true = R (raw - OFF) * SCALE, m/s^2 and rad/s, sensor axes",
        *(f"# {sentence}" for sentence in says),
        "# Vehicle-Id Component-Id Name Value Type",
        *(f"1\t1\t{n}\t{value:.9g}\t{FLOAT_TYPE}" for n, value in found.values.items()),
    ]
    write_atomically(path, "\n".join(lines) + "\n")
    return says
