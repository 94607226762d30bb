"""Accelerations that count gravity downwards, as iOS gives them to programs.

Face up and at rest, z reads -1 g there: what is accelerated counts against gravity, the
opposite of a specific force. Gravity and what Apple calls user acceleration add up to
the same, with the same sign.
"""

from __future__ import annotations

import re
from collections.abc import Container, Sequence

_APPLE = re.compile(
    r"accelerometer_?acceleration|motion_?gravity|user_?acceleration(?=\W|_|[xyz]\b)",
    re.IGNORECASE,
)
"""Names that programs take over from Core Motion, without a space between the words."""

IN_G = (None, "g")
"""Units in which such a program writes what it was given: of another it may have turned
the sign as well."""

TURNED = (
    "its accelerations are called as iOS calls them, which counts gravity downwards (-1"
    " g on the axis that is up): their sign is turned"
)
UNSURE = (
    "its accelerations are called as iOS calls them, but are not in g: if the axis that"
    " is up reads less than zero at rest, name them -ax -ay -az in --columns"
)


UNTOLD = (
    "Sensor Logger wrote it, whose accelerations have the other sign on iOS unless they"
    " were standardised: if the axis that is up reads less than zero at rest, name them"
    " -ax -ay -az in --columns; turns do not tell"
)
ELAPSED = "seconds_elapsed"
"""A column of Sensor Logger, which writes the same names on Android and iOS."""


def sign_of_ios(
    names: Sequence[str], beside: Container[str], unit: str | None
) -> tuple[bool, str]:
    """Whether accelerations count gravity downwards, and what to say of it.

    Parameters
    ----------
    names : of their columns
    beside : of all columns of the file
    unit : that these say, or None

    >>> sign_of_ios(["accelerometerAccelerationX(G)"], [], "g")[0]
    True
    >>> sign_of_ios(["acceleration_x"], [], "g")
    (False, '')
    """
    if not any(_APPLE.search(name) for name in names):
        return False, UNTOLD if names and ELAPSED in beside else ""
    turned = unit in IN_G
    return turned, TURNED if turned else UNSURE
