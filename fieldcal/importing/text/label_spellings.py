"""Labels and values as programs spell them, each as a label, a colon and its value.

x 0.1 y 0.2 z 9.8                  x: 0.1 y: 0.2 z: 9.8
accel x,y,z: 0.1, 0.2, 9.8         accel x: 0.1 y: 0.2 z: 9.8
(ax, ay, az) = (0.1, 0.2, 9.8)     ax: 0.1 ay: 0.2 az: 9.8
acc_xyz: 0.1, 0.2, 9.8             acc: 0.1, 0.2, 9.8
accel 0.1 0.2 9.8 m/s/s            accel: 0.1 0.2 9.8 m/s/s
ax: 0.1 (m/s²) ay: 0.2 (m/s²)      ax: 0.1 m/s², ay: 0.2 m/s²,
t: 5 (0.1 seconds ago)             t: 5
ax: 8192 (0.5 g)                   ax: 0.5 g
time: 14:20:31.5                   time: 51631.500000
LSM6DSL [acc/mg]: 10, -2, 999      LSM6DSL acc [mg]: 10, -2, 999
accel(0.1, 0.2, 9.8)               accel: 0.1, 0.2, 9.8
accel: {'x': 0.1, 'y': 0.2, 'z': 9.8}       Acc (mg) [ 10.1, -2.3, 999.1 ]
"""

from __future__ import annotations

import re
from datetime import date

from fieldcal.importing.text.repeated_lines import NUMBER
from fieldcal.importing.words.heading_units import (
    THERMOMETERS,
    parse_unit,
    sensor_of_unit,
)
from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.importing.words.sensor_words import AXES

EPOCH_DAY = date(1970, 1, 1).toordinal()
"""Days from the year 1 to 1970."""

MAX_UNIT_LETTERS = 18
"""Letters of a unit; what is longer is a sentence."""

_BRACKET = re.compile(r"[\[\](){}<>]")
_LIST = re.compile(rf"(?<=[:=])\s*[\[({{<]\s*({NUMBER}(?:[\s,;]+{NUMBER})*)\s*[\])}}>]")
_LISTED = re.compile(
    rf"(\([^()]*\)|[A-Za-z])\s*(?:\[\s*({NUMBER}(?:[\s,;]+{NUMBER})*)\s*\]"
    rf"|\(\s*({NUMBER}(?:[\s,;]+{NUMBER}){{2}})\s*\))"
)
"""Values in a list right behind a label or its unit in brackets."""

_WITH_UNIT = re.compile(r"\[([A-Za-z]+)/([^\[\]/]+)\](?=\s*[:=])")
"""What is measured and its unit, within brackets."""

_FROM_AXIS = re.compile(r"([)\]])(?:\s+-\s+|\s*:\s*)(?=[xyzXYZ]\s*[:=])")
"""A dash or a colon between a unit in brackets and the first axis."""

_DICT = re.compile(
    r"[{(]\s*"
    + r"\s*,\s*".join(rf"['\"]?{a}['\"]?\s*[:=]\s*({NUMBER})" for a in AXES)
    + r"\s*[})]",
    re.IGNORECASE,
)
"""Three axes as Python prints them, or JavaScript."""

_SPACED = re.compile(
    r"\b" + r"[\s,;|]+".join(rf"({axis})\s+({NUMBER})" for axis in AXES), re.IGNORECASE
)
"""Three axes with a space before their value."""

_BEHIND = re.compile(
    rf"(?<![\w.])({NUMBER})\s*"
    rf"[(\[]([^()\[\]\d][^()\[\]]{{0,{MAX_UNIT_LETTERS}}})[)\]](?!\s*[:=\[])"
)
"""A value with its unit in brackets behind it."""

_REMARK = re.compile(rf"(?<=[\d)\]]) *\(\s*{NUMBER}(?: ?[A-Za-z]+){{2,}}\s*\)")
"""A sentence in brackets behind a value: how long ago it was."""

_ADDRESS = re.compile(r"(?<=\d) *\((?=[^()]*0x)[^()]*(?:\([^()]*\)[^()]*)*\)")
"""The address that a number stands for, in brackets behind it."""

_CONVERTED = re.compile(
    rf"(?<=[:=\s])[-+]?\d+\s*\(\s*({NUMBER})\s*"
    rf"([^()\d\s][^()]{{0,{MAX_UNIT_LETTERS}}}?)\s*\)"
)
"""Counts, and in brackets what they are in a unit."""

_CLOCK = re.compile(
    r"(?<=[A-Za-z_\])])(\s*[:=]\s*)(?:(\d{4}-\d\d-\d\d)[T ])?"
    r"(\d{1,2}):([0-5]\d):([0-5]\d(?:[.,]\d+)?)Z?(?![:.,]?\d)"
)
"""A time of a clock behind a label, also with its date."""

_NAMES = re.compile(
    r"[(\[]?\b([A-Za-z_]\w*(?:\s*[,/]\s*[A-Za-z_]\w*)+)\s*[)\]]?\s*[:=]\s*"
    rf"[(\[]?\s*({NUMBER}(?:[\s,;]+{NUMBER})*)\s*[)\]]?"
)
"""Labels in a list, and a list of their values."""

_OVER_AXES = re.compile(
    r"([A-Za-z_)])[\s_(\[]+x\s*[,/]?\s*y\s*[,/]?\s*z\b\s*[)\]]?\s*[:=]", re.IGNORECASE
)
"""A label that lists the axes of its values."""

_PAIRS = re.compile(rf"\s*(?:[A-Za-z_]\w*\s+{NUMBER}[\s,;|]*){{3,}}")
_PAIR = re.compile(rf"([A-Za-z_]\w*)\s+(?={NUMBER})")
"""Labels with a space before their value, where a line holds nothing else."""

_THREE = re.compile(
    rf"(\s*[A-Za-z_]\w*)\s+({NUMBER}\s+{NUMBER}\s+{NUMBER})\s+(\D+?)\s*"
)
"""A label with three values and their unit, where a line holds nothing else."""

_UNNAMED = re.compile(rf"\s*({NUMBER})\s*(\D+?)\s*")
"""A value with its unit alone in a line."""

_ALONE = re.compile(rf"\s*([A-Za-z_]\w*)(?:\s+is)?\s+({NUMBER}\D*)")
"""A label with its value alone in a line, as programs print a temperature."""


def plain_labels(line: str) -> str:
    """A line with a colon behind each label, and without brackets.

    >>> plain_labels("accel x 0.1 y 0.2 z 9.8 (m/s^2)")
    'accel x: 0.1 y: 0.2 z: 9.8 m/s^2, '
    >>> plain_labels("gx, gy, gz : 1, 2, 3 dps"), plain_labels("Acc (mg) [ 1, 2, 3 ]")
    ('gx: 1 gy: 2 gz: 3 dps', 'Acc (mg): 1, 2, 3')
    >>> plain_labels("timestamp: 5020000 (0.003524 seconds ago)")
    'timestamp: 5020000'
    >>> plain_labels("device_id: 3670026 (Type: 0x38, SPI:1 (0x00))")
    'device_id: 3670026'
    >>> plain_labels("ax: 8192 (0.5 g) ay: 0 (0.0 g)")
    'ax: 0.5 g,  ay: 0.0 g, '
    >>> plain_labels("t: 0:00:05.25, at: 2024-05-03T14:20:31.5")
    't: 5.250000, at: 1714746031.500000'
    """
    # most lines of a long log have none
    bracketed = _BRACKET.search(line) is not None
    if bracketed:
        line = _CONVERTED.sub(_in_unit, _ADDRESS.sub("", line))
        line = _WITH_UNIT.sub(_unit_apart, _REMARK.sub("", line))
        line = _FROM_AXIS.sub(r"\1 ", line)
    line = _NAMES.sub(_pairs, _CLOCK.sub(_in_seconds, line))
    if bracketed:
        line = _LIST.sub(r" \1", _DICT.sub(r"[\1, \2, \3]", line))
    line = _SPACED.sub(r"\1: \2 \3: \4 \5: \6", line)
    line = _OVER_AXES.sub(r"\1:", line)
    if bracketed:
        line = _BEHIND.sub(_bare_unit, line)
        line = _LISTED.sub(lambda said: f"{said[1]}: {said[2] or said[3]}", line)
    line = _PAIR.sub(r"\1: ", line) if _PAIRS.fullmatch(line) else line
    three = _THREE.fullmatch(line)
    line = (
        f"{three[1]}: {three[2]} {three[3]}" if three and parse_unit(three[3]) else line
    )
    return _of_temperature(line)


def _pairs(said: re.Match[str]) -> str:
    """Each label of a list with its value, if there are as many."""
    names, values = re.split(r"\s*[,/]\s*", said[1]), re.findall(NUMBER, said[2])
    if len(names) != len(values):
        return said[0]
    return " ".join(map("{}: {}".format, names, values)) + " "


def _in_unit(said: re.Match[str]) -> str:
    """Of counts beside what they are in a unit of a sensor, this."""
    return f"{said[1]} {said[2]}, " if sensor_of_unit(said[2]) else said[0]


def _in_seconds(said: re.Match[str]) -> str:
    """A time behind a label in s: of the day, or since 1970 where its date is said."""
    between, day, hours, minutes, seconds = said.groups()
    since = 3600 * int(hours) + 60 * int(minutes) + float(seconds.replace(",", "."))
    try:
        days = date.fromisoformat(day).toordinal() - EPOCH_DAY if day else 0
    except ValueError:
        return said[0]
    return f"{between}{86400 * days + since:.6f}"


def _unit_apart(said: re.Match[str]) -> str:
    """What is measured, with its unit alone in brackets; of a unit alone itself."""
    measured, unit = said.groups()
    if parse_unit(f"{measured}/{unit}") or not parse_unit(unit):
        return said[0]
    return f"{measured} [{unit}]"


def _bare_unit(said: re.Match[str]) -> str:
    """A value with its unit, and without what is none."""
    return f"{said[1]} {said[2] if parse_unit(said[2]) else ''}, "


def name_temperature(line: str) -> str:
    """A line that holds nothing but a temperature, with a label before it.

    >>> name_temperature("27.3 Cel"), name_temperature("3 rows")
    ('temperature: 27.3 Cel', '3 rows')
    """
    said = _UNNAMED.fullmatch(line)
    if said is None or said[2].lower() not in THERMOMETERS:
        return line
    return f"temperature: {said[1]} {said[2]}"


def _of_temperature(line: str) -> str:
    """A line that holds a temperature alone, with what stands behind a label.

    >>> _of_temperature("  Temperature 23.40 deg C"), _of_temperature("Sample 12")
    ('Temperature: 23.40 deg C', 'Sample 12')
    """
    alone = _ALONE.fullmatch(line)
    said = heading_meaning(alone[1]) if alone else None
    if alone is None or said is None or said.kind != "temperature":
        return line
    return f"{alone[1]}: {alone[2]}"
