"""The sensor that a name says: of a file whose columns are axes alone, of records.

Telephones and data sets write a file for each sensor: ``Gyroscope.csv``,
``TotalAcceleration.csv``, ``acc_exp01_user01.txt``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from fieldcal.importing.words.heading_words import words_in_name

_SENSORS = {
    "acc": ("acc", "accel", "accelerometer", "acceleration"),
    "gyr": (
        "gyr",
        "gyro",
        "gyroscope",
        "rotationrate",
        "gyroscopes",
        "angularvelocity",
    ),
}
_OTHERS = ("mag", "magnetometer", "linear", "lin", "gravity", "imu", "and", "angle",
           "orientation")  # fmt: skip
"""Words of files that hold something else, or more."""

_GLUED = re.compile(
    rf"({'|'.join('raw my data log test static cal calib rpm hz the'.split())})?"
    rf"({'|'.join(name for names in _SENSORS.values() for name in names)})"
    rf"({'|'.join('raw data log test static cal calib file values only'.split())})?"
)
"""A sensor's name together with a word that says nothing of another quantity."""

TOTAL = ("totalacceleration", "accelerometeruncalibrated")
"""Names of accelerations with gravity, whoever writes them."""

ACC = (*TOTAL, "accelerometer", "acceleration")
GYR = ("gyroscope", "gyroscopeuncalibrated", "rotationrate", "gyro")
"""Names that programs on telephones give to sensors, those that are taken first first.

From what is called an accelerometer beside a total acceleration gravity was taken out.
"""

LINEAR = ("linearacceleration", "linearaccelerometer", "useracceleration")
GRAVITY = ("gravity",)
"""Names of an acceleration without gravity, and of gravity."""

SENSOR = {"acc": "accelerometers", "gyr": "gyroscopes"}
"""What each is called in a sentence."""


def best_name(sensor: str, names: Iterable[str]) -> str | None:
    """Best of several file names for a sensor, acc or gyr; None if none matches.

    >>> best_name("acc", ["Gyroscope", "Accelerometer", "TotalAcceleration"])
    'TotalAcceleration'
    """
    ranks = {"acc": ACC, "gyr": GYR}[sensor]
    there = {name: name.lower().replace(" ", "") for name in names}
    for rank in ranks:
        for name, bare in there.items():
            if bare == rank:
                return name
    return next((name for name in there if sensor_of_file_name(name) == sensor), None)


def part_of_force(stem: str) -> str:
    """Part of the specific force that a file holds: "gravity", "linear", "" for none.

    >>> [part_of_force(stem) for stem in ("Gravity", "Linear Acceleration", "log")]
    ['gravity', 'linear', '']
    """
    bare = "".join(words_in_name(stem))
    return "gravity" if bare in GRAVITY else "linear" if bare in LINEAR else ""


def sensor_of_file_name(stem: str) -> str:
    """Sensor of a file by its name without the extension; "" if none or several.

    >>> [sensor_of_file_name(s) for s in ("TotalAcceleration", "gyro_exp01_user01")]
    ['acc', 'gyr']
    >>> [sensor_of_file_name(s) for s in ("AngularVelocity", "angular_velocity")]
    ['gyr', 'gyr']
    >>> [sensor_of_file_name(s) for s in ("rawaccdata", "33RPMgyr", "linacc")]
    ['acc', 'gyr', '']
    >>> stems = ("acc_and_gyro", "user_acceleration", "log")
    >>> [sensor_of_file_name(stem) for stem in stems]
    ['', '', '']
    """
    words = words_in_name(stem)
    words += ["".join(two) for two in zip(words, words[1:], strict=False)]
    before = dict(zip(words[1:], words, strict=False))
    letters = re.findall("[a-z]+", stem.lower())
    glued = {one[2] for word in letters if (one := _GLUED.fullmatch(word))}
    own = {*words} | glued
    said = [sensor for sensor, names in _SENSORS.items() if own & {*names}]
    more = {*words} & {*_OTHERS} or "user" in {before.get(w) for w in _SENSORS["acc"]}
    return said[0] if len(said) == 1 and not more else ""
