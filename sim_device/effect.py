"""Base class of the virtual device's effects: parameters, action and an example.

To add one, write effects/<id>.py with one subclass of `SimulatedEffect`. It states its
parameters with their ranges, and overrides the methods for what it acts on: the
installation of the device, the motion of its base, the setting of its joints, the
outputs of the sensors, their noise, the clock, or the samples between the sensors and
the wire. An effect holds its parameters only. A method that needs random numbers or a
state receives a generator, and returns a function that keeps the state. Axes are the
device's, units m/s^2, rad/s, s, K.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.sim_device.joints import Creep
from fieldcal.sim_device.motion import BaseMotion, Installation
from fieldcal.sim_device.random_process import RandomProcess
from fieldcal.sim_device.sensor_conditions import SensorConditions

AXES = ("x", "y", "z")
SIX = ("ax", "ay", "az", "gx", "gy", "gz")
GROUPS: Mapping[str, tuple[str, ...]] = {"acc": SIX[:3], "gyr": SIX[3:], "all": SIX}

Stage = Callable[[Array, Array], None]
"""Changes outputs (6, n) at times (n,) s in place: called with the times first."""


@dataclass(frozen=True, slots=True)
class Range:
    """Accepted values of a number, with a description for messages."""

    description: str
    contains: Callable[[float], bool]


ANY = Range("", lambda v: True)
ABOVE_ZERO = Range("above 0", lambda v: v > 0)
NOT_NEGATIVE = Range("0 or more", lambda v: v >= 0)


@dataclass(frozen=True, slots=True)
class Number:
    """A numeric parameter of an effect; without a default it must be given."""

    default: float | None = None
    range: Range = ANY


@dataclass(frozen=True, slots=True)
class Word:
    """A text parameter of an effect; `wording` describes the pattern in messages."""

    pattern: str
    default: str | None = None
    wording: str = ""

    @property
    def description(self) -> str:
        """Accepted values, for messages."""
        return self.wording or self.pattern.replace("|", ", ")


CHANNEL = Word("|".join((*SIX, *GROUPS)))
"""One of the outputs, or a group of them."""


@dataclass(frozen=True, slots=True)
class Example:
    """Parameters of an effect, and a session in which a diagnosis names it.

    Attributes
    ----------
    given : parameters of the effect
    device : tables of the device file, in addition to those of the session
    window_s : time in each position, s
    vibration : rms in every third position, m/s^2; None: none
    turntable : whether the device is turned at constant rates instead of held
    host_clock : whether the samples have the times at which the host received them
    in_motion : whether only a reference that follows the motion shows the effect
    unmended : why the effect improves no prediction of a position; empty if it does

    """

    given: Mapping[str, Any]
    device: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    window_s: float = 10.0
    vibration: float | None = None
    turntable: bool = False
    host_clock: bool = False
    in_motion: bool = False
    unmended: str = ""


@dataclass(frozen=True)
class SimulatedEffect:
    """An effect of a virtual device.

    Attributes
    ----------
    numbers, words : its parameters, checked and complete
    VECTOR : components; each is zero unless given, and one must be given
    NUMBERS, WORDS : its other parameters
    REPEATS : whether a device can have it more than once
    ORDER : order among effects that act on the same; equal ones act as they are given
    NEEDS_EARTH : whether it shows only with the Earth's rate
    EXAMPLE : values and a session that show it, for tests and benchmarks

    """

    numbers: Mapping[str, float] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)

    VECTOR: ClassVar[tuple[str, ...]] = ()
    NUMBERS: ClassVar[Mapping[str, Number]] = {}
    WORDS: ClassVar[Mapping[str, Word]] = {}
    REPEATS: ClassVar[bool] = False
    ORDER: ClassVar[int] = 0
    FEELS_EARTH: ClassVar[bool] = False
    """Whether the gyroscopes of a device with it feel the Earth's rate."""

    NEEDS_EARTH: ClassVar[bool] = False
    EXAMPLE: ClassVar[Example]

    def __getitem__(self, name: str) -> float:
        return self.numbers[name]

    @property
    def id(self) -> str:
        """Name in the catalogue, which is the file's."""
        return type(self).__module__.rpartition(".")[2]

    @property
    def parameters(self) -> dict[str, float | str]:
        """All parameters by name."""
        return {**self.numbers, **self.words}

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of the parameters."""
        return (*cls.VECTOR, *cls.NUMBERS, *cls.WORDS)

    def column(self, names: tuple[str, ...]) -> Array:
        """Several numeric parameters as a column, (k, 1)."""
        return np.array([self.numbers[name] for name in names])[:, None]

    def matrix(self, letter: str, v: Array) -> Array:
        """Coefficients ``<letter>ij``, absent ones zero, times a vector (3, n)."""
        rows = []
        for i in "123":
            row = np.zeros_like(v[0])
            for j in "123":
                row = row + self.numbers.get(f"{letter}{i}{j}", 0.0) * v[int(j) - 1]
            rows.append(row)
        return np.stack(rows)

    def gravity(self, g: float) -> float:
        """Gravity at the device, m/s^2, where it is `g` without this effect."""
        return g

    def change_installation(self, installation: Installation) -> Installation:
        """Return the installation of the device with this effect."""
        return installation

    def base_motion(self) -> BaseMotion | None:
        """Motion of the base that the effect causes; None: none."""
        return None

    def creep(self) -> Creep | None:
        """Overshoot and relaxation of the joints; None: none."""
        return None

    def joint_setting(
        self, rng: np.random.Generator
    ) -> Callable[[Array], Array] | None:
        """Function from commanded to reached angles of the joints, (2,) rad."""
        return None

    def vibration_rms(self, rng: np.random.Generator) -> float:
        """Vibration in the next position, rms in m/s^2."""
        return 0.0

    def added_output(self, conditions: SensorConditions) -> Array | None:
        """Contribution to the outputs, (6, n) m/s^2 and rad/s; None: none."""
        return None

    def noise_ratio(self) -> Array:
        """Ratio of the outputs' white noise with and without the effect, (6,)."""
        return np.ones(6)

    def random_bias(
        self, rate: float, rng: np.random.Generator
    ) -> RandomProcess | None:
        """Random process that is added to the outputs, sampled at `rate` Hz."""
        return None

    def lag(self) -> float:
        """Delay of the gyroscopes, s."""
        return 0.0

    def filtered_outputs(self, outputs: Callable[[Array], Array], t: Array) -> Array:
        """Outputs (6, n) of the sensors at t (n,) s, without noise.

        `outputs` gives the outputs of sensors without delay, at any instants.
        """
        return outputs(t)

    def clock_rate(self) -> float:
        """Seconds of the device's clock in a true second."""
        return 1.0

    def stamps(
        self, rng: np.random.Generator
    ) -> Callable[[Array], tuple[Array, Array]] | None:
        """Function from regular times (n,) s to stamps and times of the samples.

        All are times of the device's clock. None: both are the regular times.
        """
        return None

    def stage(self, full_scale: Array) -> Stage | None:
        """Stage of the signal chain; `full_scale` (6,) of the outputs, inf without."""
        return None

    def arrival(
        self, rng: np.random.Generator
    ) -> Callable[[int], NDArray[np.bool_]] | None:
        """Function that says which of the next n samples arrive, (n,); None: all."""
        return None


def matrix_names(letter: str, diagonal: bool = True) -> tuple[str, ...]:
    """Names ``<letter>ij`` of a matrix, row by row."""
    pairs = ((i, j) for i in "123" for j in "123" if diagonal or i != j)
    return tuple(f"{letter}{i}{j}" for i, j in pairs)


def rows(channel: str) -> list[int]:
    """Rows of the outputs of a channel or a group of channels."""
    return [SIX.index(name) for name in GROUPS.get(channel, (channel,))]


def of_acc(more: Array) -> Array:
    """Outputs (6, n) from those of the accelerometers (3, n); the others are zero."""
    return np.concatenate([more, np.zeros_like(more)])


def of_gyr(more: Array) -> Array:
    """Outputs (6, n) from those of the gyroscopes (3, n); the others are zero."""
    return np.concatenate([np.zeros_like(more), more])


def pairs(v: Array) -> Array:
    """Products xy, yz and xz of a vector (3, n)."""
    return np.stack([v[0] * v[1], v[1] * v[2], v[0] * v[2]])
