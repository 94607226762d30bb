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
from collections.abc import Iterator, Mapping, Sequence
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
    "BEYOND",
    "CHANCE",
    "FINEST",
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
    "six",
]

Kind = Literal["motion", "sensor", "chain"]
Seen = Literal[
    "position", "time", "temperature", "spectrum", "transient", "samples", "turn"
]
"""What a mismatch depends on."""

POINTS = 16
"""Values of a time constant to try: an exponential changes little from one to the
next."""

PIECES = 4
"""Instants to try within a window; the best is refined by the samples."""

WITHIN = (0.25, 0.08, 0.025, 0.008)
"""Parts of a row by which an instant is moved in it, closer and closer."""

FINEST = 1.06
"""Ratio of time constants that are told apart last."""

CHANCE = 0.01
"""That a session has an effect, where its file states no other: one of a hundred."""

BEYOND = 5e-4
"""The same of what would change by itself beside a temperature that is known to."""

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
    """A parameter that the outputs are not linear in, and the range to search.

    `kind` says what it is: a time constant of the "session" or since the "turn", an
    "instant", or the "frequency" of a line, which is found in the spectrum.
    """

    name: str
    unit: str
    low: float = 0.0
    high: float = np.inf
    kind: Literal["session", "turn", "instant", "frequency"] = "frequency"

    def grid(self, x: Experience, since: Array) -> Iterator[tuple[float, int]]:
        """Values to try in rows, each with the origin that times count from.

        `since` (o, n) is the time since the turn, by origin.
        """
        span = float(np.ptp(x.t))
        if self.kind == "instant":
            yield from ((float(at), 0) for at in instants(x))
        elif self.kind == "session":
            low, high = max(self.low, span / 20), min(self.high, 3 * span)
            for tau in np.geomspace(low, max(high, 1.01 * low), POINTS):
                yield float(tau), 0
        elif self.kind == "turn":
            for origin, times in enumerate(since):
                if not np.isfinite(soonest := float(times.min())):
                    continue  # it was never turned
                low, high = max(self.low, soonest / 4), min(self.high, span / 3)
                for tau in np.geomspace(low, max(high, 1.01 * low), POINTS):
                    yield float(tau), origin

    @property
    def finer(self) -> tuple[float, ...]:
        """Steps to the next values to try, closer and closer: ratios, or `WITHIN`."""
        return (1.0, *WITHIN) if self.kind == "instant" else (1.3, 1.13, FINEST)

    def near(self, x: Experience, here: float, ratio: float) -> Sequence[float]:
        """Values about one: to either side, or every instant next to it.

        Of instants those between rows first, then parts of a row to either side.
        """
        if self.kind != "instant":
            return here / ratio, here * ratio
        if ratio < 1:
            k = int(np.argmin(np.abs(x.t - here)))
            row = float(x.lasts[k])
            if row == 0 or abs(float(x.t[k]) - here) > 0.6 * row:
                return []  # between windows: their rows do not tell
            return [here + part * ratio * row for part in (-2, -1, 1, 2)]
        middle = (x.t[1:] + x.t[:-1]) / 2
        grid = instants(x)
        low = grid[grid < here].max(initial=-np.inf)
        high = grid[grid > here].min(initial=np.inf)
        found: list[float] = middle[(low < middle) & (middle < high)].tolist()
        return [at for at in found if at != here]


class Effect(ABC):
    """One physical effect.

    Attributes
    ----------
    kind : motion, sensor or chain
    params : its parameters, shape parameters not among them
    shapes : its shape parameters
    covariate : what it is seen through
    seen_in : the kind of mismatch that it makes
    decided_by : what the operator can do to tell it from others
    cure : what to do about it once it is known to be there, in sentences
    source : where the equation and the sizes come from

    """

    kind: ClassVar[Kind]
    params: ClassVar[tuple[Param, ...]] = ()
    shapes: ClassVar[tuple[Shape, ...]] = ()
    covariate: ClassVar[str]
    seen_in: ClassVar[Seen] = "position"
    carried_by: ClassVar[str] = ""
    """Group of a calibration that has it in it, beside one of its own name."""

    like_calibration: ClassVar[bool] = False
    """Whether bias and scale factor do the same, so that it is only ever possible."""

    decided_by: ClassVar[str]
    cure: ClassVar[str]
    source: ClassVar[str]

    def applies(self, x: Experience) -> bool:
        """Whether what it hangs on is known in some rows."""
        return True

    def chance(self, x: Experience) -> float:
        """Probability that a session has it, before its rows are seen."""
        return CHANCE

    def late(self, values: Values) -> float:
        """Seconds by which it makes the gyroscopes late."""
        return 0.0

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
    on_the_way: ClassVar[bool] = False
    """Whether it acts while the device is turned, and at rest not at all."""

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
    """A random effect: no equation but a size, which its parameters are.

    Those of every output are walks of the biases; others are of the positions' angles.
    """


class Line(Effect):
    """An oscillation: a line in the spectrum of the outputs at rest."""

    seen_in = "spectrum"

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
    seen_in: ClassVar[Seen] = "samples"

    misread: ClassVar[bool] = False
    """Whether session.toml is wrong and not the samples: a calibration of samples that
    are put right is none of those that the device sends."""

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


def instants(x: Experience) -> Array:
    """Instants at which something may change: between rows, some for each window, s."""
    middle = (x.t[1:] + x.t[:-1]) / 2
    turned = np.diff(x.position) != 0
    each = np.bincount(np.unique(x.position, return_inverse=True)[1])
    number = np.concatenate([np.arange(n) for n in each])[1:]
    step = np.repeat(np.maximum(each // PIECES, 1), each)[1:]
    kept: Array = middle[turned | (number % step == 0)]
    return kept


def six(unit_acc: str, acc: float, unit_gyr: str, gyr: float) -> tuple[Param, ...]:
    """Parameters ax ay az gx gy gz with their units and typical sizes."""
    return tuple(Param(f"a{i}", unit_acc, acc) for i in "xyz") + tuple(
        Param(f"g{i}", unit_gyr, gyr) for i in "xyz"
    )
