"""The catalogue of effects that a simulation can leave out, one a file.

The simulation everyone starts from is bias, scale factor and white noise,

    U = b + diag(k) f + n,    W = d + diag(s) w + n

with the specific force f (m/s^2) and the angular rate w (rad/s) that the known turns,
local gravity and, for navigation grade, the Earth bring about, in device axes. Effects
are of three kinds:

- motion: they change what the sensors experience, f and w (`Motion`);
- sensor: they add to what comes out (`Sensor`), linear in their parameters once the
  shape parameters (a time constant, an instant) are given;
- chain: they happen to samples (`Chain`): found on samples, modelled by leaving some
  out, by shifting or by widening.

Two forms cut across the kinds: a `Scatter` is random, has no equation but a covariance,
and widens the intervals; a `Line` is an oscillation, found in the spectrum.

To add one, write effects/<id>.py with a subclass of one of these; `catalogue` finds it
by the file's name.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from fieldcal.effects.experience import Experience
from fieldcal.effects.recording import Fault, Recording
from fieldcal.samples import Array

__all__ = [
    "NO_SHAPE",
    "Chain",
    "Effect",
    "Experience",
    "Fault",
    "Line",
    "Motion",
    "Param",
    "Recording",
    "Scatter",
    "Sensor",
    "Shape",
    "Values",
    "catalogue",
    "columns",
    "six",
]

Kind = Literal["motion", "sensor", "chain"]

Values = Sequence[float] | Array
NO_SHAPE: Mapping[str, float] = {}


@dataclass(frozen=True, slots=True)
class Param:
    """One parameter: its name in the catalogue, its unit, the size it can have.

    `typical` is the upper end of what is seen; it sets what an explanation that needs
    the parameter costs.
    """

    name: str
    unit: str
    typical: float


@dataclass(frozen=True, slots=True)
class Shape:
    """A parameter that the outputs are not linear in, and the range to search, s."""

    name: str
    unit: str
    low: float = 0.0
    high: float = np.inf


class Effect(ABC):
    """One physical effect.

    Attributes
    ----------
    kind : motion, sensor or chain
    params : its parameters, shape parameters not among them
    shapes : its shape parameters
    covariate : what it is seen through
    decided_by : what the operator can do to tell it from others
    source : where the equation and the sizes come from

    """

    kind: ClassVar[Kind]
    params: ClassVar[tuple[Param, ...]] = ()
    shapes: ClassVar[tuple[Shape, ...]] = ()
    covariate: ClassVar[str]
    decided_by: ClassVar[str]
    source: ClassVar[str]

    @property
    def id(self) -> str:
        """Name in the catalogue, which is the file's."""
        return type(self).__module__.rpartition(".")[2]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, shape parameters last."""
        return tuple(p.name for p in self.params) + tuple(s.name for s in self.shapes)

    def unit(self, name: str) -> str:
        """Unit of a parameter."""
        units = {p.name: p.unit for p in self.params}
        return (units | {s.name: s.unit for s in self.shapes})[name]


class Motion(Effect):
    """An effect on what the sensors experience.

    `order` is the place in which several are applied: what changes the vectors in the
    base first, then the base itself, then the joints.
    """

    kind = "motion"
    order: ClassVar[int] = 0

    @abstractmethod
    def change(self, x: Experience, values: Values) -> Experience:
        """Return what is experienced with the effect; `values` in `params` order."""


class Sensor(Effect):
    """An effect on the outputs, linear in its parameters."""

    kind = "sensor"

    @abstractmethod
    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Differentiate the six outputs by the parameters, (n, 6, k).

        Outputs in `samples.CHANNELS` order, m/s^2 and rad/s.
        """


class Scatter(Effect):
    """A random effect: the covariance of the outputs is value^2 F F^T."""

    @abstractmethod
    def factor(self, x: Experience, name: str) -> Array:
        """Return F of a parameter, (n, 6, m), per unit of the parameter."""


class Line(Effect):
    """An oscillation: a line in the spectrum of the outputs at rest."""

    band: ClassVar[tuple[float, float]]
    """Lowest and highest frequency, Hz."""

    @abstractmethod
    def response(self, x: Experience, hz: float) -> NDArray[np.complexfloating]:
        """Complex amplitude of the outputs per unit of each complex cause, (n, 6, m).

        An output is Re(response @ cause exp(2 pi i hz t)).
        """


class Chain(Effect):
    """An effect on samples."""

    kind = "chain"

    @abstractmethod
    def find(self, recording: Recording) -> list[Fault]:
        """Look for it in the samples."""


@cache
def catalogue() -> Mapping[str, Effect]:
    """Every effect by its id, in alphabetical order."""
    found: dict[str, Effect] = {}
    for name in sorted(m.name for m in iter_modules(__path__)):
        module = f"{__name__}.{name}"
        for thing in vars(import_module(module)).values():
            if isinstance(thing, type) and thing.__module__ == module:
                if issubclass(thing, Effect):
                    found[name] = thing()
    return found


def six(unit_acc: str, acc: float, unit_gyr: str, gyr: float) -> tuple[Param, ...]:
    """Parameters ax ay az gx gy gz with their units and typical sizes."""
    return tuple(Param(f"a{i}", unit_acc, acc) for i in "xyz") + tuple(
        Param(f"g{i}", unit_gyr, gyr) for i in "xyz"
    )


def columns(
    effect: Motion | Sensor,
    x: Experience,
    scale: Values = (1.0,) * 6,
    shape: Mapping[str, float] = NO_SHAPE,
) -> Array:
    """Differentiate the six outputs by an effect's parameters, (n, 6, k).

    Motion effects are differentiated about zero, by central differences of a thousandth
    of the typical size; `scale` are the sensors' scale factors, which what they
    experience is multiplied with.
    """
    if isinstance(effect, Sensor):
        return effect.design(x, shape)
    out = np.zeros((len(x), 6, len(effect.params)))
    for j, param in enumerate(effect.params):
        step = np.zeros(len(effect.params))
        step[j] = 1e-3 * param.typical
        up, down = effect.change(x, step), effect.change(x, -step)
        change = np.hstack([up.f - down.f, up.w - down.w]) / (2 * step[j])
        out[:, :, j] = change * np.asarray(scale)
    return out
