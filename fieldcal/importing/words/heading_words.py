"""What the name of one column says: sensor, axis, unit, and of which of several IMUs.

``ax [m/s^2]``, ``gyro_x (deg/s)``, ``imu0.AccX``, ``angular_velocity.z``, ``TimeUS``,
``accelerometer_m_s2[0]``: words, an axis, and a unit in brackets or behind a sign that
parts words. What is neither tells one IMU from another. "Linear acceleration" is weak:
some mean one without gravity by it.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from fieldcal.importing.words.heading_units import (
    TELLING,
    TEMPERATURES,
    UNITS,
    is_unit_of,
    parse_unit,
    split_thermometer_name,
)
from fieldcal.importing.words.name_and_unit import name_unit_splits
from fieldcal.importing.words.rate_names import with_axis_letter
from fieldcal.importing.words.sensor_words import (
    AXES,
    AXIS,
    BARE_STEPS,
    GAINS,
    PHRASES,
    SENSORS,
    SINCE,
    STEPS,
    TIMES,
    TURNS,
    WITHOUT_GRAVITY,
)
from fieldcal.importing.words.sensor_words import TEMPERATURES as THERMOMETER_NAMES

SCATTER = ("std", "sd", "stdev", "stddev", "sigma", "rms", "var", "variance", "noise")
"""Words of columns that hold how much values scatter."""

MEAN = ("mean", "avg", "average")

FILTERED = ("filtered", "filt", "lpf", "lp", "lowpass", "hpf", "highpass", "kalman",
            "kf", "ekf", "ukf", "smooth", "smoothed", "ema", "sma", "mavg",
            "butterworth", "savgol", "denoised")  # fmt: skip
"""Words of columns that a program filters from others."""

REFERENCE = ("true", "truth", "ref", "reference", "expected", "ideal")
"""Words of columns that hold what an output ought to be."""

_ANGLES = {"rad": "rad/s", "deg": "deg/s"}
"""Units of rates of which the name says the angle alone: PX4's ``gyro_rad[0]``."""

_NO_RATE = ("angle", "roll", "pitch", "yaw", "heading", "euler", "theta", "phi")
"""Words of angles that are no rates."""

_WHOLE = {"seq": "seq", "sequence": "seq", "t_host": "t_host", "t_h": "t_h",
          "t_min": "t_min", "delta_velocity_dt": "dv_us",
          "delta_angle_dt": "da_us"}  # fmt: skip
"""Names that are channels as they stand; the last are PX4's, us over which velocity and
angle were gained."""

_FILLERS = ("field", "data", "msg", "sensor", "raw", "value", "imu", "calibrated",
            "rate", *AXIS)  # fmt: skip
"""Words that tell no IMU from another where all of one kind have them."""

NAMES = 4096
"""Names whose meaning is remembered: a program prints the same ones in each line."""

LONGEST = 300
"""Characters of a name; what is longer is a line without columns."""

_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\W\d_A-Za-z]+")
_BRACKETS = re.compile(r"(.*?)\s*[\[({](.*)[\])}]\s*")
_BRACKETED_AXIS = re.compile(r"[\[(]([xyzXYZ])[\])]")
_BARE = re.compile("[\u0300-\u036f]")
"""Accents, once they are apart from their letters."""

_AXIS_SIGN = re.compile("[軸轴]")
"""Axis, behind its letter: ``X軸加速度``."""

_G_FORCE = re.compile(r"G\s?\(([xyzXYZ])\)")
"""How programs that read cars call what a telephone feels."""


class HeadingMeaning(NamedTuple):
    """Meaning of the name of a column.

    Attributes
    ----------
    kind : of `UNITS`; "" for an axis of which no sensor is said
    axis : x, y or z, or nothing
    unit : None where none is said
    label : what else the name says, such as which IMU
    weak : whether something else may be meant
    gain : whether it is what velocity or angle gained since the row before
    half : whether it is half the angle, as the quaternion of a turn has it

    """

    kind: str
    axis: str
    unit: str | None
    label: tuple[str, ...] = ()
    weak: bool = False
    gain: bool = False
    half: bool = False


@lru_cache(NAMES)
def heading_meaning(name: str, unit: str = "") -> HeadingMeaning | None:
    """Return the meaning of a name; None if it names no channel.

    Parameters
    ----------
    name : of a column
    unit : what the file says of it elsewhere, or nothing

    >>> heading_meaning("imu1_GyroX (dps)")
    HeadingMeaning(kind='g', axis='x', unit='deg/s', label=('imu', '1'), \
weak=False, gain=False, half=False)
    """
    if len(name) > LONGEST:
        return None
    name = _BARE.sub("", unicodedata.normalize("NFD", name))
    # signs of one syllable belong together again
    name = _AXIS_SIGN.sub(" ", unicodedata.normalize("NFC", name))
    if force := _G_FORCE.fullmatch(name.strip()):
        return HeadingMeaning("a", force.group(1).lower(), "g")
    name = _BRACKETED_AXIS.sub(r" \1 ", name.strip().strip('"')).strip()
    if (whole := _WHOLE.get(name.lower().rpartition(".")[2])) is not None:
        return HeadingMeaning(whole, "", None)
    for bare, said in name_unit_splits(name, unit):
        found = _meaning_of_words([w.lower() for w in _WORD.findall(bare)], said)
        if found is None or (said is not None and not is_unit_of(said, found.kind)):
            continue
        if found.kind or said is not None:
            found = _as_angle_rate(found)
            return found._replace(
                kind=found.kind or _kind_of(said),
                weak=found.weak or bool({*WITHOUT_GRAVITY} & {*found.label}),
            )
    return _unnamed_thermometer(name, unit)


def _unnamed_thermometer(name: str, unit: str) -> HeadingMeaning | None:
    """The meaning of a name that says a thermometer by its unit alone: imu_degC."""
    said = split_thermometer_name(name, unit)
    words = [w.lower() for w in _WORD.findall(said[0])] if said else []
    # an axis, whatever it is of, is no thermometer
    if said is None or {*words} & {*"xyz"}:
        return None
    return HeadingMeaning("temperature", "", said[1], tuple(words), True)


def _as_angle_rate(found: HeadingMeaning) -> HeadingMeaning:
    """Meaning of a rate whose name states the unit of angle."""
    words = [w for w in found.label if w in _ANGLES]
    if (
        found.kind != "g"
        or found.unit
        or len(words) != 1
        or {*_NO_RATE} & {*found.label}
    ):
        return found
    label = tuple(w for w in found.label if w not in words)
    return found._replace(unit=_ANGLES[words[0]], label=label)


def _kind_of(unit: str | None) -> str:
    return next(kind for kind in "ag" if unit in UNITS[kind])


def _meaning_of_words(words: list[str], unit: str | None) -> HeadingMeaning | None:
    if not words:
        return None
    for name in TURNS:
        if (at := _find_phrase(words, name)) is not None:
            rest = words[:at] + words[at + len(name) :]
            turn = _with_axis("g", rest, unit, weak=True)
            return turn and turn._replace(gain=True, half=True)
    words = with_axis_letter(words, unit in UNITS["g"])
    if unit in TEMPERATURES and {*words} & {"t", *THERMOMETER_NAMES}:
        label = tuple(w for w in words if w not in ("t", *THERMOMETER_NAMES))
        return HeadingMeaning("temperature", "", unit, label)
    if words == ["x"] and unit in UNITS["t"]:
        # what is drawn to the right
        return HeadingMeaning("t", "", unit)
    if (step := _step_meaning(words, unit)) is not None:
        return step
    for phrase, kind in (*PHRASES, *GAINS):
        if (at := _find_phrase(words, phrase)) is not None:
            rest = words[:at] + words[at + len(phrase) :]
            gain = (phrase, kind) in GAINS
            # of gains as well, what was measured itself goes before them
            weak = kind == "linear" or gain
            found = _with_axis("a" if kind == "linear" else kind, rest, unit, weak)
            return found._replace(gain=gain) if found is not None else None
    if (found := _meaning_of_sensor(words, unit)) is not None:
        return found
    if (time := _time_meaning(words, unit)) is not None:
        return time
    for word in THERMOMETER_NAMES:
        if word in words:
            label = tuple(w for w in words if w != word)
            return HeadingMeaning("temperature", "", unit, label)
    if (alone := bare_axis(words)) is not None:
        return HeadingMeaning("", alone[0], unit, alone[1])
    # whatever it is called, an axis in rad/s is one of a gyroscope
    return _with_axis("", words, unit) if unit in TELLING else None


def _meaning_of_sensor(words: list[str], unit: str | None) -> HeadingMeaning | None:
    """The meaning of an axis of a sensor: words before letters, as those of ``gx3``."""
    for letters in (False, True):
        for find in (_joined_meaning, _parted_meaning):
            if (found := find(words, unit, letters)) is not None:
                return found
    return None


def _joined_meaning(
    words: list[str], unit: str | None, letters: bool
) -> HeadingMeaning | None:
    """The meaning of a word that is a sensor and its axis: ``accx``, or ``gx``."""
    for i, word in enumerate(words):
        rest = words[:i] + words[i + 1 :]
        if (len(word) == len("gx")) != letters:
            continue
        kind = next((k for k, names in SENSORS.items() if word[:-1] in names), "")
        # of "GyX" the axis is the X
        apart = word in SENSORS["g"] and bool(rest[i:]) and rest[i] in "xyz"
        if kind and word[-1] in "xyz" and not apart:
            return HeadingMeaning(kind, word[-1], unit, tuple(rest))
        kind = next((k for k, names in SENSORS.items() if word[1:] in names), "")
        if kind and word[0] in "xyz" and len(word) > len("xg"):
            return HeadingMeaning(kind, word[0], unit, tuple(rest))
    return None


def _parted_meaning(
    words: list[str], unit: str | None, letters: bool
) -> HeadingMeaning | None:
    """The meaning of a sensor whose axis is another word."""
    for i, word in enumerate(words):
        rest = words[:i] + words[i + 1 :]
        if (len(word) == 1) != letters:
            continue
        kind = next((k for k, names in SENSORS.items() if word in names), "")
        # a letter stands before its axis: "x_g" is an axis in g
        if kind and (not letters or (rest[i:] and rest[i] in AXES)):
            found = _with_axis(kind, rest, unit)
            if found is not None:
                return found
    return None


def bare_axis(words: Sequence[str]) -> tuple[str, tuple[str, ...]] | None:
    """An axis without a sensor, and its statistic: ``x_mean``, ``y``, ``std_z``.

    None where any other word is there.
    """
    label = tuple(w for w in words if w in (*MEAN, *SCATTER, *REFERENCE))
    rest = [w for w in words if w not in (*label, *AXIS)]
    return (rest[0], label) if rest in (["x"], ["y"], ["z"]) else None


def words_in_name(name: str) -> list[str]:
    """The words of a name without its unit, in small letters."""
    bracketed = _BRACKETS.fullmatch(name.strip())
    bare = bracketed.group(1) if bracketed else name
    return [w.lower() for w in _WORD.findall(bare)]


def _find_phrase(words: Sequence[str], phrase: Sequence[str]) -> int | None:
    n = len(phrase)
    places = range(len(words) - n + 1)
    return next((i for i in places if tuple(words[i : i + n]) == tuple(phrase)), None)


def _with_axis(
    kind: str, rest: list[str], unit: str | None, weak: bool = False
) -> HeadingMeaning | None:
    """Meaning with the last axis among the other words; None if there is none."""
    letters = [i for i, word in enumerate(rest) if word in AXES]
    if not letters:
        return None
    # of "acc_x_x1" the x with a number says which sensor it is
    plain = [i for i in letters if not "".join(rest[i + 1 : i + 2]).isdecimal()]
    at = (plain or letters)[-1]
    return HeadingMeaning(kind, rest[at], unit, tuple(rest[:at] + rest[at + 1 :]), weak)


def _step_meaning(words: list[str], unit: str | None) -> HeadingMeaning | None:
    """The meaning of the time since the row before."""
    for names in (*STEPS, *BARE_STEPS):
        if (at := _find_phrase(words, names)) is not None:
            rest = words[:at] + words[at + len(names) :]
            inner = [u for w in rest if (u := parse_unit(w)) in UNITS["dt"]]
            timed = names in STEPS or bool(inner) or unit in UNITS["dt"]
            if len(inner) == len(rest) and timed:
                return HeadingMeaning("dt", "", unit or (inner[-1] if inner else None))
    return None


def _time_meaning(words: list[str], unit: str | None) -> HeadingMeaning | None:
    """The meaning of a time: by its name, or by a unit of time that is all of it."""
    said = unit if unit and is_unit_of(unit, "t") else None
    named = [w for w in words if w in TIMES]
    rest = [w for w in words if w not in TIMES]
    inner = [w for w in rest if parse_unit(w) in UNITS["t"]]
    if named or (len(inner) == len(rest) == 1 and len(rest[0]) > 1):
        said = said or (parse_unit(inner[-1]) if inner else None)
        label = tuple(w for w in rest if w not in inner)
        return HeadingMeaning("t", "", said if unit is None or said else unit, label)
    since = said or (parse_unit(inner[-1]) if inner else None)
    if since and set(rest) - set(inner) and set(rest) <= {*inner, *SINCE}:
        return HeadingMeaning("t", "", since, tuple(w for w in rest if w not in inner))
    return None


def bare_label(words: tuple[str, ...]) -> tuple[str, ...]:
    """Words of a label that distinguish one IMU from another."""
    return tuple(w for w in words if w not in _FILLERS)
