"""Rates that are called after what they turn, as those who fly and drive do.

``roll_rate``, ``yawrate``, ``gyro_q``: roll and p are about x, pitch and q about y, yaw
and r about z. ``gyro_roll`` is no rate: some call an angle so that they integrate.
"""

from __future__ import annotations

from collections.abc import Sequence

RATES = ("rate", "gyro", "gyr", "gyroscope", "omega")
"""Words of rates."""

ANGLES = {"roll": "x", "pitch": "y", "yaw": "z"}
LETTERS = {"p": "x", "q": "y", "r": "z"}


def with_axis_of(words: Sequence[str]) -> list[str]:
    """Words of a name, with the axis in place of what it is called after.

    >>> with_axis_of(["yawrate", "dps"]), with_axis_of(["gyro", "p"])
    (['rate', 'z', 'dps'], ['gyro', 'x'])
    >>> with_axis_of(["yaw"]), with_axis_of(["gyro", "yaw"])
    (['yaw'], ['gyro', 'yaw'])
    """
    parted = [part for word in words for part in _parted(word)]
    axes = LETTERS | (ANGLES if "rate" in parted else {})
    named = [word for word in parted if word in axes]
    if len(named) != 1 or not {*parted} & {*RATES}:
        return [*words]
    return [axes.get(word, word) for word in parted]


def _parted(word: str) -> list[str]:
    axis = word.removesuffix("rate")
    return ["rate", axis] if word != axis and axis in ANGLES else [word]
