"""Names of parameters: a group and a component, written ``group.component``."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from typing import Literal

AXES = "xyz"

SENSORS = {
    "acc_bias": "acc",
    "acc_scale": "acc",
    "gyr_bias": "gyr",
    "gyr_scale": "gyr",
}
"""The sensor of each group that is always reported in device axes."""

SCALES = frozenset({"acc_scale", "gyr_scale"})
"""Groups of scale factors."""

COUPLINGS = {"cross_coupling": "k", "gyro_cross_coupling": "s"}
"""First letter of the components of the cross-couplings, such as ``k12``."""

Tilt = Literal["none", "angle_offset", "base_tilt"]

TILTS: tuple[Tilt, ...] = ("angle_offset", "base_tilt")
"""Groups in degrees that say how a base is tilted; a calibration has one of them."""


@dataclass(frozen=True, slots=True)
class ParameterName:
    """Name of one parameter.

    Attributes
    ----------
    group : ``acc_bias``, ``gyr_scale``, or the id of an effect
    component : an axis, or a parameter of the effect; empty where there is one only

    """

    group: str
    component: str = ""

    @classmethod
    def of(cls, name: str) -> ParameterName:
        """Read a name as files have it.

        >>> ParameterName.of("cross_coupling.k12").entry
        (0, 1)
        """
        group, _, component = name.partition(".")
        return cls(group, component)

    def __str__(self) -> str:
        return f"{self.group}.{self.component}" if self.component else self.group

    @property
    def sensor(self) -> str:
        """``acc`` or ``gyr`` for a bias or a scale factor; empty for an effect."""
        return sensor_of(self.group)

    @property
    def is_scale(self) -> bool:
        """Whether it is a scale factor."""
        return self.group in SCALES

    @property
    def axis(self) -> int:
        """Index of the axis of a bias or a scale factor."""
        return AXES.index(self.component)

    @property
    def channel(self) -> int:
        """Index of the output of a bias or a scale factor in `samples.CHANNELS`.

        >>> ParameterName.of("gyr_bias.y").channel
        4
        """
        return self.axis + (3 if self.sensor == "gyr" else 0)

    @property
    def entry(self) -> tuple[int, int]:
        """Row and column, from 0, of a cross-coupling such as ``k12``."""
        return int(self.component[1]) - 1, int(self.component[2]) - 1


def possible_components(group: str) -> tuple[str, ...]:
    """Components of a group of the linear model; empty for others, which have any.

    >>> possible_components("cross_coupling")
    ('k12', 'k13', 'k21', 'k23', 'k31', 'k32')
    """
    if group in SENSORS:
        return tuple(AXES)
    if group in COUPLINGS:
        pairs = permutations("123", 2)
        return tuple(f"{COUPLINGS[group]}{i}{j}" for i, j in pairs)
    return ()


def sensor_of(group: str) -> str:
    """``acc`` or ``gyr`` for a bias or a scale factor; empty for an effect."""
    return SENSORS.get(group, "")


def group_of(name: str) -> str:
    """Group of a parameter.

    >>> group_of("acc_bias.x")
    'acc_bias'
    """
    return ParameterName.of(name).group
