"""Axes that a name lists in the order in which their values follow it.

``Accelerometer (z,x,y) [m/s2]`` is what cameras by GoPro write over three columns, and
beside lists of three numbers.
"""

from __future__ import annotations

import re

from fieldcal.importing.words.sensor_words import AXES

_LISTED = re.compile(
    r"(.*?)\s*[\[(]\s*([xyz])\s*[,;]\s*([xyz])\s*[,;]\s*([xyz])\s*[\])]\s*(.*)",
    re.IGNORECASE,
)


def listed_axes(name: str) -> tuple[str, ...]:
    """Axes in their order, as a name lists them; none of another name.

    >>> listed_axes("Gyroscope (z,x,y) [rad/s]"), listed_axes("Accel (x)")
    (('z', 'x', 'y'), ())
    """
    said = _LISTED.fullmatch(name.strip())
    axes = tuple(axis.lower() for axis in said.groups()[1:4]) if said else ()
    return axes if {*axes} == {*AXES} else ()


def names_of_listed_axes(name: str) -> list[str]:
    """Name of each of three columns over which one name lists the axes.

    >>> names_of_listed_axes("Gyroscope (z,x,y) [rad/s]")[0]
    'Gyroscope z [rad/s]'
    """
    said = _LISTED.fullmatch(name.strip())
    before, behind = (said[1], said[5]) if said else (name, "")
    return [f"{before} {axis} {behind}".strip() for axis in listed_axes(name)]
