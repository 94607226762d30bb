"""What an autopilot takes out of its sensors for their temperature.

ArduPilot, with INS_TCALn_ENABLE = 1, polynomials P without a constant about 35 °C, and
the temperature INS_ACCn_CALTEMP at which offset and scale hold (-300: never said),

    v - P(T - 35) + P(T_cal - 35),   P(d) = 1e-6 (c1 d + c2 d^2 + c3 d^3)           (1)

with T and T_cal held within INS_TCALn_TMIN and TMAX. PX4, with TC_A_ENABLE = 1, by the
set j whose TC_Aj_ID is the sensor's own,

    v - (X0 + X1 d + X2 d^2 + X3 d^3),   d = T - TC_Aj_TREF                         (2)

with T held within TC_Aj_TMIN and TMAX; TC_G for gyroscopes. Both before offset and
scale. T °C, v m/s^2 or rad/s. Source: ArduPilot, AP_InertialSensor_tempcal.cpp; PX4,
TemperatureCompensation.cpp.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array, Block

INSTANCES = 3
NEVER = -300.0

IDS = {"A": "CAL_ACC{}_ID", "G": "CAL_GYRO{}_ID"}
"""Where PX4 keeps the number of a sensor, by the letter of its set."""

WHOLE = (
    *("TC_A_ENABLE", "TC_G_ENABLE"),
    *(f"TC_{s}{n}_ID" for s in IDS for n in range(INSTANCES)),
    *(known.format(n) for known in IDS.values() for n in range(INSTANCES)),
)
"""Parameters of PX4 that are whole numbers."""

FIRST_ID = 1310988
"""Of the first sensor; the next ones follow."""


def parameters(kind: str) -> dict[str, float]:
    """Parameters of an autopilot that nobody has calibrated over temperature."""
    table: dict[str, float] = {}
    if kind == "px4":
        table |= dict.fromkeys(WHOLE, 0.0)
        for n in range(INSTANCES):
            table |= {known.format(n): FIRST_ID + n for known in IDS.values()}
            for s in IDS:
                table |= {
                    f"TC_{s}{n}_X{k}_{i}": 0.0 for k in range(4) for i in range(3)
                }
                limits = {"TREF": 25.0, "TMIN": 0.0, "TMAX": 100.0}
                table |= {f"TC_{s}{n}_{name}": v for name, v in limits.items()}
        return table
    for n in range(1, INSTANCES + 1):
        table |= {f"INS_TCAL{n}_ENABLE": 0.0}
        table |= {f"INS_TCAL{n}_TMIN": 0.0, f"INS_TCAL{n}_TMAX": 70.0}
        for s in ("ACC", "GYR"):
            table[f"INS_{s}{n}_CALTEMP"] = NEVER
            for k in (1, 2, 3):
                table |= {f"INS_TCAL{n}_{s}{k}_{x}": 0.0 for x in "XYZ"}
    return table


def thermal_correction(
    kind: str, instance: int, known: Mapping[str, float], block: Block
) -> tuple[Array, Array]:
    """What comes off accelerometers and gyroscopes, (n, 3) each."""
    if kind == "px4":
        acc, gyr = (_px4(s, instance, known, block.temperature) for s in IDS)
    else:
        acc, gyr = (
            _ardupilot(s, instance + 1, known, block.temperature)
            for s in ("ACC", "GYR")
        )
    return acc, gyr


def _ardupilot(
    sensor: str, n: int, known: Mapping[str, float], degrees: Array
) -> Array:
    if known[f"INS_TCAL{n}_ENABLE"] != 1.0:
        return np.zeros((len(degrees), 3))
    ends = known[f"INS_TCAL{n}_TMIN"], known[f"INS_TCAL{n}_TMAX"]
    out = np.zeros((len(degrees), 3))
    calibrated = known[f"INS_{sensor}{n}_CALTEMP"]
    for t, sign in ((degrees, 1.0), (np.full(len(degrees), calibrated), -1.0)):
        d = np.clip(t, *ends) - 35.0
        for i, x in enumerate("XYZ"):
            for k in (1, 2, 3):
                out[:, i] += sign * 1e-6 * known[f"INS_TCAL{n}_{sensor}{k}_{x}"] * d**k
    return out


def _px4(sensor: str, n: int, known: Mapping[str, float], degrees: Array) -> Array:
    out = np.zeros((len(degrees), 3))
    if known[f"TC_{sensor}_ENABLE"] != 1.0:
        return out
    wanted = known[IDS[sensor].format(n)]
    mine = [j for j in range(INSTANCES) if known[f"TC_{sensor}{j}_ID"] == wanted]
    for j in mine[:1]:
        ends = known[f"TC_{sensor}{j}_TMIN"], known[f"TC_{sensor}{j}_TMAX"]
        d = np.clip(degrees, *ends) - known[f"TC_{sensor}{j}_TREF"]
        for i in range(3):
            out[:, i] = sum(known[f"TC_{sensor}{j}_X{k}_{i}"] * d**k for k in range(4))
    return out
