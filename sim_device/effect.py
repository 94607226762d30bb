"""What every effect of the virtual device is: what it takes, what it does, an example.

To add one, write effects/<id>.py with one subclass of `SimulatedEffect`. It says what
parameters it has and in which ranges, and defines the methods of what it acts on: where
the device stands, the motion of its base, the setting of its joints, the outputs of the
sensors, their noise, the clock, or the samples between the sensors and the wire. An
effect holds its parameters only; a method that needs random numbers or a memory gets
the numbers, and returns a function that keeps the memory. Axes are the device's, units
m/s^2, rad/s, s, K.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.sim_device.joints import Creep
from fieldcal.sim_device.life import Life
from fieldcal.sim_device.motion import BaseMotion, Stand
from fieldcal.sim_device.random_process import RandomProcess

AXES = ("x", "y", "z")
SIX = ("ax", "ay", "az", "gx", "gy", "gz")
GROUPS: Mapping[str, tuple[str, ...]] = {"acc": SIX[:3], "gyr": SIX[3:], "all": SIX}

Stage = Callable[[Array, Array], None]
"""Changes outputs (6, n) at times (n,) s in place: called with the times first."""


@dataclass(frozen=True, slots=True)
class Range:
    """Values that a number can have, and how that is said."""

    says: str
    holds: Callable[[float], bool]


ANY = Range("", lambda v: True)
ABOVE_ZERO = Range("above 0", lambda v: v > 0)
NOT_NEGATIVE = Range("0 or more", lambda v: v >= 0)


@dataclass(frozen=True, slots=True)
class Number:
    """A number that an effect takes; it must be given if it has no default."""

    default: float | None = None
    range: Range = ANY


@dataclass(frozen=True, slots=True)
class Word:
    """A word that an effect takes, by its pattern; `shape` is how that is said."""

    pattern: str
    default: str | None = None
    shape: str = ""

    @property
    def says(self) -> str:
        """What can be given, for people."""
        return self.shape or self.pattern.replace("|", ", ")


CHANNEL = Word("|".join((*SIX, *GROUPS)))
"""One of the outputs, or a group of them."""


@dataclass(frozen=True, slots=True)
class Example:
    """An effect that a diagnosis names, and what the session needs to show it.

    Attributes
    ----------
    given : parameters
    device : tables of the device file, beside those of the session
    window_s : how long the device is held in a position, s
    vibration : rms in every third position, m/s^2; None: none
    turntable : whether it is turned at constant rates instead of held
    host_clock : whether the samples come with the times at which the host got them
    in_motion : whether only a reference that follows the motion shows it
    unmended : why no position is predicted better once it is known; empty if one is

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
    """One thing that a virtual device is told to have.

    Attributes
    ----------
    numbers, words : its parameters, checked and complete
    VECTOR : components, each zero unless given, of which one must be given
    NUMBERS, WORDS : what it takes beside them
    REPEATS : whether a device can have it more than once
    ORDER : place among those that act on the same; equal ones act as they are given
    NEEDS_EARTH : whether it shows in the Earth's rate only
    EXAMPLE : values and a session that show it; tests and benchmarks draw from it

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
        """Several numbers at once, one below the other, (k, 1)."""
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
        """Gravity where the device stands, m/s^2, if it would be `g` without this."""
        return g

    def stands(self, stand: Stand) -> Stand:
        """How the device is held, apart from its joints."""
        return stand

    def base_motion(self) -> BaseMotion | None:
        """Motion of the base, if it makes it move."""
        return None

    def creep(self) -> Creep | None:
        """How its joints overshoot and relax, if they do."""
        return None

    def setting(self, rng: np.random.Generator) -> Callable[[Array], Array] | None:
        """From where the joints should end up to where they do, (2,) rad."""
        return None

    def shaking(self, rng: np.random.Generator) -> float:
        """Vibration in the position that is taken now, rms in m/s^2."""
        return 0.0

    def adds(self, life: Life) -> Array | None:
        """What comes on top of the outputs, (6, n) m/s^2 and rad/s."""
        return None

    def noise_ratio(self) -> Array:
        """White noise of the outputs against what it is without, (6,)."""
        return np.ones(6)

    def wander(self, rate: float, rng: np.random.Generator) -> RandomProcess | None:
        """What wanders on top of the outputs, sampled at `rate` Hz."""
        return None

    def lag(self) -> float:
        """Seconds by which it makes the gyroscopes late."""
        return 0.0

    def followed(self, outputs: Callable[[Array], Array], t: Array) -> Array:
        """What the sensors put out at t (n,) s, (6, n), without noise.

        `outputs` are those of sensors that follow at once, at any instants.
        """
        return outputs(t)

    def pace(self) -> float:
        """Seconds of the device's clock in a true second."""
        return 1.0

    def stamps(
        self, rng: np.random.Generator
    ) -> Callable[[Array], tuple[Array, Array]] | None:
        """From even times (n,) s of the device's clock to stamps, and when samples are.

        None: both are the even times.
        """
        return None

    def stage(self, full_scale: Array) -> Stage | None:
        """What happens to samples; `full_scale` (6,) of the outputs, inf without."""
        return None

    def arrival(
        self, rng: np.random.Generator
    ) -> Callable[[int], NDArray[np.bool_]] | None:
        """Which of the next n samples arrive, (n,) bool; None: all of them."""
        return None


def matrix_names(letter: str, diagonal: bool = True) -> tuple[str, ...]:
    """Names ``<letter>ij`` of a matrix, row by row."""
    pairs = ((i, j) for i in "123" for j in "123" if diagonal or i != j)
    return tuple(f"{letter}{i}{j}" for i, j in pairs)


def rows(channel: str) -> list[int]:
    """Rows of the outputs that a channel's name means."""
    return [SIX.index(name) for name in GROUPS.get(channel, (channel,))]


def of_acc(more: Array) -> Array:
    """Outputs (6, n) of which only the accelerometers' (3, n) are not zero."""
    return np.concatenate([more, np.zeros_like(more)])


def of_gyr(more: Array) -> Array:
    """Outputs (6, n) of which only the gyroscopes' (3, n) are not zero."""
    return np.concatenate([np.zeros_like(more), more])


def pairs(v: Array) -> Array:
    """Products xy, yz and xz of a vector (3, n)."""
    return np.stack([v[0] * v[1], v[1] * v[2], v[0] * v[2]])
