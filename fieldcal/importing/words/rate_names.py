"""Rates that are called after what they turn, as those who fly and drive do.

``roll_rate``, ``yawrate``, ``gyro_q``: roll and p are about x, pitch and q about y, yaw
and r about z. ``gyro_roll`` is no rate: some call an angle so that they integrate.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.importing.words.sensor_words import AXES

RATES = ("rate", "gyro", "gyr", "gyroscope", "omega")
"""Words of rates."""

ANGLES = {"roll": "x", "pitch": "y", "yaw": "z"}
LETTERS = {"p": "x", "q": "y", "r": "z"}


def with_axis_letter(words: Sequence[str], as_rate: bool = False) -> list[str]:
    """Words of a name with a rate's own name replaced by its axis.

    Parameters
    ----------
    words : of a name
    as_rate : whether its unit is that of a rate: "Yaw" in deg/s is a yaw rate

    >>> with_axis_letter(["yawrate", "dps"]), with_axis_letter(["gyro", "p"])
    (['rate', 'z', 'dps'], ['gyro', 'x'])
    >>> with_axis_letter(["yaw"]), with_axis_letter(["gyro", "yaw"])
    (['yaw'], ['gyro', 'yaw'])
    >>> with_axis_letter(["yaw"], as_rate=True)
    ['z', 'rate']
    """
    parted = [part for word in words for part in _split_name(word)]
    if any(word[-1:] in AXES and word[:-1] in ("", *RATES) for word in parted):
        # an r beside an axis is what is to the right
        return [*words]
    if as_rate and {*parted} & {*ANGLES} and "rate" not in parted:
        parted.append("rate")
    axes = LETTERS | (ANGLES if "rate" in parted else {})
    named = [word for word in parted if word in axes]
    if len(named) != 1 or not {*parted} & {*RATES}:
        return [*words]
    return [axes.get(word, word) for word in parted]


def _split_name(word: str) -> list[str]:
    axis = word.removesuffix("rate")
    return ["rate", axis] if word != axis and axis in ANGLES else [word]
