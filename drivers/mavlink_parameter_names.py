"""Names of the parameters that autopilots have for each of their IMUs.

Source: parameter lists of ArduPilot (INS_*) and PX4 (CAL_*).
"""

from __future__ import annotations

from fieldcal.core.errors import InputError

ARDUPILOT, PX4 = 3, 12
"""Numbers of the autopilot programs in a heartbeat."""

AXES = "XYZ"

GYRO_CAL_AT_START = "INS_GYR_CAL"
"""Parameter of ArduPilot: whether it averages its gyroscopes at each start."""

SENSORS = {ARDUPILOT: 5, PX4: 4}
"""Number of IMUs that each program has parameters for."""

MOST_SENSORS = max(SENSORS.values())

NUMBERED_SENSORS = 3
"""ArduPilot's sensors whose number follows the sensor's name, as in INS_ACC2OFFS; that
of further ones comes first, as in INS4_ACCOFFS."""


def ardupilot_prefix(what: str, instance: int, first: str = "") -> str:
    """Beginning of ArduPilot's names of the parameters of one IMU.

    Parameters
    ----------
    what : ``ACC``, ``GYR`` or ``TCAL``
    instance : number of the IMU, from 0
    first : number of the first IMU in the name: most names have none there

    >>> [ardupilot_prefix("ACC", n) for n in (0, 1, 3)]
    ['INS_ACC', 'INS_ACC2', 'INS4_ACC']

    """
    number = instance + 1
    if number > NUMBERED_SENSORS:
        return f"INS{number}_{what}"
    return f"INS_{what}{number if instance else first}"


def parameter_names(
    autopilot: int, instance: int, gyr_instance: int | None = None
) -> dict[str, tuple[str, ...]]:
    """Names of the parameters for offsets, scales and mounting, by what they hold.

    Parameters
    ----------
    autopilot : number of its program
    instance : which of its sensors, from 0
    gyr_instance : likewise of the gyroscope, where PX4 has it under another number

    >>> parameter_names(ARDUPILOT, 1)["acc_scale"]
    ('INS_ACC2SCAL_X', 'INS_ACC2SCAL_Y', 'INS_ACC2SCAL_Z')
    """
    if autopilot == ARDUPILOT:
        acc, gyr = (ardupilot_prefix(triad, instance) for triad in ("ACC", "GYR"))
        return {
            "acc_offset": tuple(f"{acc}OFFS_{axis}" for axis in AXES),
            "acc_scale": tuple(f"{acc}SCAL_{axis}" for axis in AXES),
            "gyr_offset": tuple(f"{gyr}OFFS_{axis}" for axis in AXES),
            "rotation": ("AHRS_ORIENTATION",),
        }
    if autopilot == PX4:
        other = instance if gyr_instance is None else gyr_instance
        return {
            "acc_offset": tuple(f"CAL_ACC{instance}_{axis}OFF" for axis in AXES),
            "acc_scale": tuple(f"CAL_ACC{instance}_{axis}SCALE" for axis in AXES),
            "gyr_offset": tuple(f"CAL_GYRO{other}_{axis}OFF" for axis in AXES),
            "rotation": ("SENS_BOARD_ROT",),
        }
    return {}


def check_number(autopilot: int, instance: int) -> None:
    """Refuse the number of an IMU that a program has no parameters for.

    Raises
    ------
    InputError
        With the largest number.

    """
    if instance >= SENSORS.get(autopilot, MOST_SENSORS):
        raise InputError(
            f"the autopilot has no sensor {instance}: its last one is"
            f" {SENSORS[autopilot] - 1}"
        )


def replaced_at_start(instance: int, averages: float | None = None) -> tuple[str, ...]:
    """What ArduPilot replaces when it starts, a sentence if it does.

    Parameters
    ----------
    instance : number of the IMU, from 0
    averages : its `GYRO_CAL_AT_START`; None if unknown

    """
    if averages == 0:
        return ()
    known = "" if averages is None else f"{GYRO_CAL_AT_START} = {averages:g}: "
    unless = f"unless {GYRO_CAL_AT_START} = 0, " if averages is None else ""
    first = f"{ardupilot_prefix('GYR', instance)}OFFS_X"
    return (
        f"{known}{unless}the autopilot averages its gyroscopes at each start and"
        f" replaces {first}, Y, Z, whatever is written; set {GYRO_CAL_AT_START} = 0 to"
        " keep them",
    )


def other_processing_parameters(autopilot: int, instance: int) -> tuple[str, ...]:
    """Parameters of other processing: low-pass, temperature, averaging at start.

    Not every program has them; one without an answer is ignored.
    """
    if autopilot == ARDUPILOT:
        corrects = f"{ardupilot_prefix('TCAL', instance, '1')}_ENABLE"
        return ("INS_ACCEL_FILTER", "INS_GYRO_FILTER", corrects, GYRO_CAL_AT_START)
    if autopilot == PX4:
        cutoffs = ("IMU_ACCEL_CUTOFF", "IMU_GYRO_CUTOFF")
        return (*cutoffs, "TC_A_ENABLE", "TC_G_ENABLE")
    return ()
