"""Parameters over temperature, as autopilots take them.

ArduPilot takes a polynomial without a constant about 35 °C, in 1e-6 of m/s^2 or rad/s
per K^k, off the sensor's output r before offset and scale, and adds it back for the
temperature T_cal at which these hold:

    f = (r - P(T - 35) + P(T_cal - 35) - OFFS) SCAL                                 (1)

T and T_cal are held within TMIN and TMAX. With U = b(T) + s f: P(T - 35) = b(T) less
its constant there, T_cal = T_ref, OFFS = b(T_ref), SCAL = 1 / s(T_ref). PX4 takes

    f = (r - X0 - X1 d - X2 d^2 - X3 d^3 - OFF) SCALE,   d = T - TREF               (2)

with the set whose ID is the sensor's; X0 stays 0, so that OFF holds at TREF also where
the compensation is off. Neither has a scale factor over temperature. Source:
ArduPilot, AP_InertialSensor_tempcal.cpp and INS_TCALn_*, INS_ACCn_CALTEMP in its list
of parameters; PX4, TemperatureCompensation.h and Accelerometer.hpp, TC_*.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.drivers.mavlink_parameter_names import (
    ARDUPILOT,
    PX4,
    ardupilot_prefix,
    check_number,
    parameter_names,
    replaced_at_start,
)
from fieldcal.thermal import ThermalCurve, ThermalModel
from fieldcal.thermal.curves import TERMS

ARDUPILOT_REFERENCE_C = 35.0
MICRO = 1e6
"""ArduPilot's coefficients are in millionths."""

SENSORS = {"acc": ("ACC", "A", "CAL_ACC{}_ID"), "gyr": ("GYR", "G", "CAL_GYRO{}_ID")}
"""What ArduPilot and PX4 call the triads, and where PX4 keeps a sensor's number."""

UNITS = {"acc": "m/s^2", "gyr": "rad/s"}


@dataclass(frozen=True, slots=True)
class ThermalParameter:
    """One parameter of an autopilot.

    Attributes
    ----------
    value, sigma : with its standard uncertainty, 0 where it is a choice
    unit : of both
    whole : whether it is a whole number

    """

    value: float
    sigma: float = 0.0
    unit: str = "1"
    whole: bool = False


@dataclass(frozen=True, slots=True)
class ThermalParameters:
    """All parameters to install, and what must be known of them, a sentence each."""

    values: Mapping[str, ThermalParameter]
    says: tuple[str, ...]


def thermal_parameters(
    autopilot: int,
    model: ThermalModel,
    instance: int = 0,
    ids: Mapping[str, float] | None = None,
) -> ThermalParameters:
    """Return what takes a device's parameters out at any temperature of the sessions.

    Parameters
    ----------
    autopilot : number of its program
    model : of the sensor's own output
    instance : which of its sensors, from 0
    ids : what PX4 says of its CAL_ACCn_ID and CAL_GYROn_ID; None unknown

    Raises
    ------
    InputError
        If the model has biases neither of accelerometers nor of gyroscopes, or the
        program no such sensor.

    """
    check_number(autopilot, instance)
    known = parameter_names(autopilot, instance)
    values: dict[str, ThermalParameter] = {}
    for sensor in SENSORS:
        if (bias := model.of(f"{sensor}_bias")) is None:
            continue
        if autopilot == ARDUPILOT:
            values |= _ardupilot(sensor, instance, bias, model)
        else:
            values |= _px4(sensor, instance, bias, model, ids)
        values |= _there(known[f"{sensor}_offset"], bias, UNITS[sensor])
    if not values:
        raise InputError("the sessions determined no bias that could be installed")
    if (scale := model.of("acc_scale")) is not None:
        values |= {
            name: ThermalParameter(1 / s, sigma / s**2)
            for name, (s, sigma) in _zip(known["acc_scale"], scale)
        }
    said = [*_says(model), *_of_program(autopilot, instance, ids)]
    if autopilot == ARDUPILOT and model.of("gyr_bias") is not None:
        said += replaced_at_start(instance)
    return ThermalParameters(values, tuple(said))


def id_names(instance: int) -> tuple[str, ...]:
    """Where PX4 keeps the numbers of a sensor's triads."""
    return tuple(where.format(instance) for *_, where in SENSORS.values())


def _there(
    known: tuple[str, ...], curves: list[ThermalCurve], unit: str
) -> dict[str, ThermalParameter]:
    """Values at the reference temperature."""
    return {n: ThermalParameter(v, s, unit) for n, (v, s) in _zip(known, curves)}


def _zip(
    known: tuple[str, ...], curves: list[ThermalCurve]
) -> list[tuple[str, tuple[float, float]]]:
    return [(n, c.value(0.0)) for n, c in zip(known, curves, strict=True)]


def _ardupilot(
    sensor: str, instance: int, bias: list[ThermalCurve], model: ThermalModel
) -> dict[str, ThermalParameter]:
    """Coefficients of (1), about 35 °C."""
    word = SENSORS[sensor][0]
    head = ardupilot_prefix("TCAL", instance, "1")
    caltemp = f"{ardupilot_prefix(word, instance, '1')}_CALTEMP"
    shift = _shifted(ARDUPILOT_REFERENCE_C - model.reference)
    values = {
        f"{head}_ENABLE": ThermalParameter(1.0),
        f"{head}_TMIN": ThermalParameter(model.low, unit="degC"),
        f"{head}_TMAX": ThermalParameter(model.high, unit="degC"),
        caltemp: ThermalParameter(model.reference, unit="degC"),
    }
    for axis, curve in zip("XYZ", bias, strict=True):
        a = shift @ curve.coefficients
        sigma = np.sqrt(np.diag(shift @ curve.covariance @ shift.T))
        for k in range(1, TERMS):
            values[f"{head}_{word}{k}_{axis}"] = ThermalParameter(
                MICRO * a[k], MICRO * sigma[k], _unit(f"1e-6*{UNITS[sensor]}", k)
            )
    return values


def _px4(
    sensor: str,
    n: int,
    bias: list[ThermalCurve],
    model: ThermalModel,
    ids: Mapping[str, float] | None,
) -> dict[str, ThermalParameter]:
    """Coefficients of (2)."""
    _, letter, where = SENSORS[sensor]
    head = f"TC_{letter}{n}"
    values = {
        f"TC_{letter}_ENABLE": ThermalParameter(1.0, whole=True),
        f"{head}_TREF": ThermalParameter(model.reference, unit="degC"),
        f"{head}_TMIN": ThermalParameter(model.low, unit="degC"),
        f"{head}_TMAX": ThermalParameter(model.high, unit="degC"),
    }
    if ids is not None:
        number = ids[where.format(n)]
        values[f"{head}_ID"] = ThermalParameter(number, whole=True)
    for i, curve in enumerate(bias):
        values[f"{head}_X0_{i}"] = ThermalParameter(0.0, unit=UNITS[sensor])
        sigma = np.sqrt(np.diag(curve.covariance))
        for k in range(1, TERMS):
            values[f"{head}_X{k}_{i}"] = ThermalParameter(
                float(curve.coefficients[k]), float(sigma[k]), _unit(UNITS[sensor], k)
            )
    return values


def _unit(of: str, k: int) -> str:
    return f"{of}/K" if k == 1 else f"{of}/K^{k}"


def _shifted(by: float) -> Array:
    """Matrix from coefficients about a temperature to those about another, K above."""
    columns = [
        Polynomial.basis(n)(Polynomial([by, 1.0])).coef if n else np.ones(1)
        for n in range(TERMS)
    ]
    out = np.zeros((TERMS, TERMS))
    for n, column in enumerate(columns):
        out[: len(column), n] = column
    return out


def _says(model: ThermalModel) -> list[str]:
    """What these parameters cannot hold, and what that costs."""
    says = []
    for sensor, per, unit in (("acc", G0, "m/s^2 at 1 g"), ("gyr", 1.0, "of the rate")):
        scale = model.of(f"{sensor}_scale")
        if scale is None:
            continue
        ends = [model.low - model.reference, model.high - model.reference]
        worst = max(abs(c.change(t, 0.0)[0]) for c in scale for t in ends)
        says.append(
            f"{sensor}_scale over temperature has no place in these parameters: leaving"
            f" it out makes errors up to {worst * per:.2g} {unit} at the ends of the"
            " range"
        )
    for group in ("cross_coupling", "gyro_cross_coupling"):
        if any(name.startswith(f"{group}.") for name in model.curves):
            says.append(f"{group} has no place in these parameters: it is left out")
    says += [
        f"{sensor}_bias was not determined: not written"
        for sensor in SENSORS
        if model.of(f"{sensor}_bias") is None
    ]
    return says


def _of_program(
    autopilot: int, instance: int, ids: Mapping[str, float] | None
) -> list[str]:
    if autopilot == PX4 and ids is None:
        pairs = " and ".join(
            f"TC_{letter}{instance}_ID to the value of {where.format(instance)}"
            for _, letter, where in SENSORS.values()
        )
        return [f"PX4 uses none of it before you set {pairs}"]
    return []
