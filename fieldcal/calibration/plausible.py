"""Values that no sensor has in the declared axes and units.

They show that a stated fact is wrong, however well everything else agrees: a scale
factor far from nominal means another unit or full scale; a bias of half a g, a device
or driver that subtracts its mean; a scale factor of the opposite sign, an axis that
points the other way; a tilt of tens of degrees, another mounting; turns that contradict
the positions, other axes.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.calibration.names import TILTS, ParameterName, group_of, sensor_of
from fieldcal.calibration.parameters import Nominal
from fieldcal.core.samples import Array
from fieldcal.core.sentences import join_words

MIN_SCALE_SHARE, MIN_SCALE_SIGMAS = 0.1, 5.0
"""A scale factor below this part of nominal, and below so many standard deviations,
counts as zero."""

UNREAL = {"acc_scale": 0.1, "gyr_scale": 0.1, "acc_bias": 5.0, "gyr_bias": 0.5}
"""Difference from nominal that no sensor has: 10 %, three times the tolerance of
consumer grade; half a g; 30 deg/s."""

MAX_TILT_DEG = 10.0
"""Largest plausible tilt of a base, deg; session.toml accepts no larger level."""

MENTIONED = 3
"""Largest number of turns that are named."""


def implausible_values(
    names: Sequence[str], values: Array, sigma: Array, nominal: Nominal
) -> list[str]:
    """Sentences about values that no sensor has in the declared axes and units."""
    said = []
    for name, value, s in zip(names, values, sigma, strict=True):
        parameter = ParameterName.of(name)
        if parameter.group in TILTS:
            said += _tilt(name, float(value), float(s))
        if parameter.group not in UNREAL:
            continue
        usual = getattr(nominal, parameter.group)[parameter.axis]
        if parameter.group in ("acc_scale", "gyr_scale"):
            said += _scale(name, float(value), float(s), usual)
        else:
            said += _bias(name, float(value), float(s), usual, nominal)
    return said


def misdirected_turns(turns: Sequence[tuple[str, str]]) -> list[str]:
    """A sentence about turns whose measured rotation contradicts the positions.

    Parameters
    ----------
    turns : names of the positions before and after each turn

    """
    if not turns:
        return []
    named = [f"{before} to {behind}" for before, behind in turns[:MENTIONED]]
    count, more = len(turns), len(turns) - len(named)
    return [
        f"in {count} turn{'s' if count > 1 else ''} the gyroscopes lead to another"
        f" attitude than the accelerometers or the stated angles (from"
        f" {join_words(named)}{f', and {more} more' if more else ''}): an axis, a sign,"
        " a unit or an angle is another than session.toml says, samples of the turn are"
        " missing, or the gyroscopes were clipped; mend it, or turn more slowly"
    ]


def _tilt(name: str, value: float, sigma: float) -> list[str]:
    if abs(value) - MIN_SCALE_SIGMAS * sigma <= MAX_TILT_DEG:
        return []
    return [
        f"{name} is {value:.3g}° ± {sigma:.2g}°: no base is that far out of level; the"
        " device is mounted otherwise than [frame] mounting says (a z-up unit is"
        ' ["+x", "-z", "+y"]), or was turned otherwise'
    ]


def _scale(name: str, value: float, sigma: float, usual: float) -> list[str]:
    if abs(value) < min(MIN_SCALE_SIGMAS * sigma, MIN_SCALE_SHARE * abs(usual)):
        return [
            f"{name} is {value:.2g} ± {sigma:.2g}: the output does not follow at"
            " all; was the device turned as session.toml says?"
        ]
    if value / usual < 0 and abs(value) > MIN_SCALE_SIGMAS * sigma:
        return [
            f"{name} is {value:.3g}, nominal {usual:.3g}: the axis points"
            " the other way; mend [frame] mounting, or the signs of the angles or"
            " rates"
        ]
    group = group_of(name)
    if abs(value - usual) > max(UNREAL[group] * abs(usual), MIN_SCALE_SIGMAS * sigma):
        return [
            f"{name} is {value:.3g} ± {sigma:.2g}, nominal {usual:.3g}: no sensor is"
            " that far off; the unit or full scale of the recording is another than"
            f" [nominal] says ({value / usual:.4g} times it fits), or the"
            " angles or turns are others than it says"
        ]
    return []


def _bias(
    name: str, value: float, sigma: float, usual: float, nominal: Nominal
) -> list[str]:
    parameter = ParameterName.of(name)
    sensor = sensor_of(parameter.group)
    unit = abs(getattr(nominal, f"{sensor}_scale")[parameter.axis])
    if abs(value - usual) <= max(
        UNREAL[parameter.group] * unit, MIN_SCALE_SIGMAS * sigma
    ):
        return []
    si = "m/s^2" if sensor == "acc" else "rad/s"
    return [
        f"{name} is {(value - usual) / unit:+.3g} {si} from nominal: no sensor is that"
        " far off; either the device or its driver takes its mean out, or the offset"
        " in [nominal] is another"
    ]
