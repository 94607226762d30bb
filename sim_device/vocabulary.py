"""The effects that a virtual device can be given, by id and parameter.

A parameter is a number or a word. Of the components of a vector any may be left out
and is zero, but one must be given; other parameters have a default or must be given.
On the command line an effect is ``ID:param=value,…``. In a device file it is a table
``[effects.ID]``, or several tables ``[[effects.ID]]`` if it can happen more than once.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fieldcal.core.errors import InputError

AXES = ("x", "y", "z")
SIX = ("ax", "ay", "az", "gx", "gy", "gz")
MATRIX = tuple((i, j) for i in "123" for j in "123")
CHANNELS = (*SIX, "acc", "gyr", "all")
FAULTS = ("low_byte_signed", "bytes_swapped", "wrapped")
UNITS = ("g", "mg", "deg/s", "mrad/s")


@dataclass(frozen=True, slots=True)
class SimulatedEffect:
    """One thing that a virtual device is told to have."""

    id: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)

    def __getitem__(self, name: str) -> float:
        return self.numbers[name]

    def vector(self, names: tuple[str, ...]) -> tuple[float, ...]:
        """Several numbers at once."""
        return tuple(self.numbers[name] for name in names)

    @property
    def parameters(self) -> dict[str, float | str]:
        """All parameters by name."""
        return {**self.numbers, **self.words}


@dataclass(frozen=True, slots=True)
class _Entry:
    """What an id takes.

    Attributes
    ----------
    vector : components, each zero unless given, of which one must be given
    numbers : other numbers with their defaults, None where they must be given
    words : patterns of words with their defaults, None where they must be given
    repeats : whether it can be given more than once

    """

    vector: tuple[str, ...] = ()
    numbers: Mapping[str, float | None] = field(default_factory=dict)
    words: Mapping[str, tuple[str, str | None]] = field(default_factory=dict)
    repeats: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.vector, *self.numbers, *self.words)


def _matrix(letter: str) -> tuple[str, ...]:
    return tuple(f"{letter}{i}{j}" for i, j in MATRIX)


def _off_diagonal(letter: str) -> tuple[str, ...]:
    return tuple(f"{letter}{i}{j}" for i, j in MATRIX if i != j)


_CHANNEL = ("|".join(CHANNELS), None)

CATALOGUE: Mapping[str, _Entry] = {
    "cross_coupling": _Entry(_off_diagonal("k")),
    "gyro_cross_coupling": _Entry(_off_diagonal("s")),
    "gyro_scale": _Entry(("s1", "s2", "s3")),
    "quadratic": _Entry(AXES),
    "cubic": _Entry(AXES),
    "scale_asymmetry": _Entry(AXES),
    "pendulous_products": _Entry(_matrix("l")),
    "g_sensitivity": _Entry(_matrix("g")),
    "g2_sensitivity": _Entry(AXES),
    "gyro_products": _Entry(_matrix("p")),
    "base_tilt": _Entry(("about_x_deg", "about_z_deg")),
    "angle_offset": _Entry(("alpha0_deg", "beta0_deg")),
    "angle_scale": _Entry(("alpha", "beta")),
    "angle_setting": _Entry(numbers={"sigma_deg": None}),
    "gravity_error": _Entry(numbers={"relative": None}),
    "earth_rate": _Entry(repeats=True),
    "heading_error": _Entry(numbers={"psi_deg": None}),
    "sway": _Entry(
        numbers={
            "amplitude_deg": None,
            "hz": None,
            "phase_deg": 0.0,
            "azimuth_deg": 45.0,
        },
        repeats=True,
    ),
    "mounting": _Entry(
        words={
            "axes": (r"(?:[+-][xyz]){3}", ""),
            "unit": ("|".join(UNITS), ""),
        }
    ),
    "temperature_bias": _Entry(SIX),
    "temperature_scale": _Entry(AXES),
    "thermal_hysteresis": _Entry(SIX),
    "warm_up": _Entry(SIX, {"tau_s": None}, repeats=True),
    "bias_drift": _Entry(SIX),
    "bias_step": _Entry(SIX, {"at_s": None}, repeats=True),
    "random_walk": _Entry(SIX),
    "settling": _Entry(SIX, {"tau_s": None}, repeats=True),
    "lever_arm": _Entry(AXES),
    "vibration_rectification": _Entry(AXES, {"level": 0.3}),
    "hum": _Entry(SIX, {"hz": None, "phase_deg": 0.0}, repeats=True),
    "bump": _Entry(
        numbers={
            "at_s": None,
            "for_s": None,
            "push": 2.0,
            "tilt_deg": 0.5,
            "azimuth_deg": 30.0,
        },
        repeats=True,
    ),
    "time_delay": _Entry(numbers={"seconds": None}),
    "quantisation": _Entry(("acc", "gyr")),
    "saturation": _Entry(
        numbers={"limit": None}, words={"channel": _CHANNEL}, repeats=True
    ),
    "stuck": _Entry(
        numbers={"from_s": None, "to_s": None},
        words={"channel": _CHANNEL},
        repeats=True,
    ),
    "dropped": _Entry(numbers={"fraction": None}),
    "clock_skew": _Entry(numbers={"ppm": None}),
    "decode_fault": _Entry(
        numbers={"full_scale": 0.0},
        words={"channel": _CHANNEL, "kind": ("|".join(FAULTS), None)},
        repeats=True,
    ),
    "noise_level": _Entry(
        numbers={"ratio": None}, words={"channel": _CHANNEL}, repeats=True
    ),
}
"""Every id with what it takes; units as in the device's outputs: m/s^2, rad/s, s, K."""

_Rule = tuple[Callable[[float], bool], str]
_ABOVE_ZERO: _Rule = (lambda v: v > 0, "above 0")
_NOT_NEGATIVE: _Rule = (lambda v: v >= 0, "0 or more")
_RULES: Mapping[str, _Rule] = {
    **dict.fromkeys(("tau_s", "hz", "limit", "ratio", "for_s"), _ABOVE_ZERO),
    **dict.fromkeys(("sigma_deg", "level", "full_scale"), _NOT_NEGATIVE),
    "fraction": (lambda v: 0 <= v < 1, "0 or more, below 1"),
    "relative": (lambda v: -0.5 < v < 0.5, "between -0.5 and 0.5"),
    "ppm": (lambda v: abs(v) < 1e5, "between -100000 and 100000"),
    "seconds": (lambda v: abs(v) <= 1, "between -1 and 1"),
}


def effect(id_: str, given: Mapping[str, Any]) -> SimulatedEffect:
    """Check the parameters of one effect and fill in the defaults.

    Raises
    ------
    InputError
        If there is no such id or parameter, one is missing, or a value is out of range.

    >>> effect("cross_coupling", {"k12": 0.003}).vector(("k12", "k13"))
    (0.003, 0.0)
    """
    entry = CATALOGUE.get(id_)
    if entry is None:
        known = ", ".join(CATALOGUE)
        raise InputError(f"no effect is called {id_!r}; the device knows {known}")
    for name in given:
        if name not in entry.names:
            takes = ", ".join(entry.names) or "no parameter"
            raise InputError(f"{id_} has no parameter {name!r}; it takes {takes}")
    if entry.vector and not any(name in given for name in entry.vector):
        some = ", ".join(entry.vector)
        raise InputError(f"{id_} needs at least one of {some}")
    defaults: dict[str, float | None] = {**dict.fromkeys(entry.vector, 0.0)}
    defaults.update(entry.numbers)
    numbers = {
        name: _number(id_, name, given.get(name, default))
        for name, default in defaults.items()
    }
    words = {
        name: _word(id_, name, given.get(name, default), pattern)
        for name, (pattern, default) in entry.words.items()
    }
    return SimulatedEffect(id_, numbers, words)


def parse(text: str) -> SimulatedEffect:
    """Read ``ID:param=value,…`` of the command line.

    Raises
    ------
    InputError
        If the text has not that form, or `effect` refuses what it says.

    >>> parse("settling:ax=-0.03,tau_s=4")["tau_s"]
    4.0
    """
    id_, _, rest = text.partition(":")
    given: dict[str, Any] = {}
    for part in filter(None, (p.strip() for p in rest.split(","))):
        name, equals, value = (p.strip() for p in part.partition("="))
        if not equals or not name:
            raise InputError(f"{text!r}: {part!r} is not PARAMETER=VALUE, as in hz=50")
        if name in given:
            raise InputError(f"{text!r} gives {name} twice; leave one out")
        given[name] = value
    return effect(id_.strip(), given)


def check_together(effects: tuple[SimulatedEffect, ...]) -> None:
    """Refuse an effect given twice that can only be there once.

    Raises
    ------
    InputError
        Naming the effect.

    """
    seen: set[str] = set()
    for one in effects:
        if one.id in seen and not CATALOGUE[one.id].repeats:
            raise InputError(
                f"{one.id} is given twice; give all its parameters at once"
            )
        seen.add(one.id)


def _number(id_: str, name: str, value: Any) -> float:
    if value is None:
        raise InputError(f"{id_} needs {name}, as in {id_}:{name}=…")
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{id_}: {name} must be a number, not {value!r}")
    good, range_ = _RULES.get(name, (lambda v: True, ""))
    if not good(number):
        raise InputError(f"{id_}: {name} must be {range_}, not {number:g}")
    return number


def _word(id_: str, name: str, value: Any, pattern: str) -> str:
    if value is None:
        raise InputError(f"{id_} needs {name}, one of {pattern.replace('|', ', ')}")
    text = "".join(value) if isinstance(value, list | tuple) else str(value)
    if text and not re.fullmatch(pattern, text):
        shape = "like +x-z+y" if name == "axes" else pattern.replace("|", ", ")
        raise InputError(f"{id_}: {name} must be {shape}, not {text!r}")
    return text
