"""Base classes of effects: equation, parameters, typical sizes, cure.

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
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.physics.experience import Experience
from fieldcal.physics.lag import Lag
from fieldcal.physics.recording import CheckedSamples, Fault
from fieldcal.physics.shape import Shape

Kind = Literal["motion", "sensor", "chain"]
Seen = Literal[
    "position", "time", "temperature", "spectrum", "transient", "samples", "turn"
]
"""What a mismatch depends on."""

CHANCE = 0.01
"""Default prior probability that a session has an effect: one in a hundred."""

BEYOND = 5e-4
"""Prior probability of a change in time alone if the temperature is known to change."""

Values = Sequence[float] | Array
NO_SHAPE: Mapping[str, float] = {}


@dataclass(frozen=True, slots=True)
class Param:
    """One parameter: its name in the catalogue, its unit, the size it can have.

    `typical` is the upper end of sizes in devices. It is the prior size, so it decides
    how much an explanation with the parameter costs.
    """

    name: str
    unit: str
    typical: float


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

    like_calibration: ClassVar[str] = ""
    """Group of a calibration that does the same, so that it is only ever possible."""

    while_moving: ClassVar[bool] = False
    """Whether it shows only where a reference follows the motion moment by moment."""

    event: ClassVar[str] = ""
    """What happens at its instant, if other effects come of it too: where one of them
    is, the others are likely, at the same instant."""

    one_vector: ClassVar[bool] = False
    """Whether its parameters are components of one vector: it is along one axis, or
    along none in particular. A component that is not seen is no reason for it to be
    zero beside two others."""

    usual: ClassVar[bool] = False
    """Whether every triad has it until it is calibrated: who has one has the others."""

    turned_into: ClassVar[Mapping[str, str]] = {}
    """Parameters with those that they become in a device that is turned as a whole:
    where nobody knows how it stands, the rows show the sum of the two."""

    turned_by: ClassVar[Mapping[str, tuple[str, str, float]]] = {}
    """What that turn adds to parameters: another effect, its parameter that becomes
    zero, and the sign."""

    absent: ClassVar[str] = ""
    """When it adds nothing to biases and scale factors that it changes, in words: they
    are fitted beside it as they are then. Empty for an effect that does not change."""

    ruins: ClassVar[str] = ""
    """Why nothing can be calibrated that has it, in words; empty where it can."""

    decided_by: ClassVar[str]
    cure: ClassVar[str]
    source: ClassVar[str]

    def applies(self, x: Experience) -> bool:
        """Whether its covariate is known in some rows."""
        return True

    def acts_on(self, x: Experience) -> bool:
        """Whether it changes rows like these, where others show that it is there."""
        return self.applies(x)

    def chance(self, x: Experience) -> float:
        """Probability that a session has it, before its rows are seen."""
        return CHANCE

    def lag(self, values: Values) -> Lag:
        """Delay and time constants of the sensors that it adds."""
        return Lag()

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
    """An effect on the outputs, linear in its parameters or nearly so."""

    kind = "sensor"

    of_inputs: ClassVar[bool] = False
    """Whether it changes what the sensors sense, as a turn of the device or a filter of
    the motion does: the outputs change by the scale factors times as much, and by less
    than nothing where an axis is mirrored."""

    def gain(self, scale: Array) -> Array:
        """Change of the six outputs per unit of `design`, from the scale factors."""
        return scale if self.of_inputs else np.ones(6)

    @abstractmethod
    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Differentiate the six outputs by the parameters, (n, 6, k).

        Outputs in `samples.CHANNELS` order, m/s^2 and rad/s; inputs, if the effect is
        one `of_inputs`.
        """

    def change_of_outputs(
        self, x: Experience, values: Array, shape: Mapping[str, float] = NO_SHAPE
    ) -> Array:
        """Change of the six outputs by parameters (k,), (n, 6), before `gain`."""
        return outputs_at(self.design(x, shape), values)


def outputs_at(design: Array, values: Array) -> Array:
    """Outputs (n, 6) of columns (n, 6, k) at values (k,).

    As one product of a matrix: numpy is slow at many of small ones.
    """
    out: Array = design.reshape(-1, len(values)) @ values
    return out.reshape(design.shape[:-1])


class Separable(Sensor):
    """An effect whose columns are a pattern on the outputs times a course.

    The course is a function of time or temperature by the shape parameters; the pattern
    is the same for all of them.
    """

    @abstractmethod
    def pattern(self, x: Experience) -> Array:
        """Derivative of the outputs by the parameters at a course of 1, (n, 6, k)."""

    @abstractmethod
    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Value of the course in each row, (n,)."""

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """The pattern times the course."""
        out: Array = self.pattern(x) * self.course(x, shape)[:, None, None]
        return out


class BiasChange(Separable):
    """An effect that adds one course to every output, each by a parameter of its own.

    Parameters are those of `six`. `with_scales` says that scale factors change as well,
    as they do with the temperature and when a device restarts.
    """

    with_scales: ClassVar[bool] = False

    def pattern(self, x: Experience) -> Array:
        """One on each output, by its own parameter."""
        return np.broadcast_to(np.eye(6), (len(x), 6, 6))


class ScaleChange(Separable):
    """An effect that adds one course to the accelerometers' scale factors.

    Parameters are named x, y and z, one for each.
    """

    def pattern(self, x: Experience) -> Array:
        """Force along its own axis on each output of the accelerometers."""
        out = np.zeros((len(x), 6, 3))
        out[:, range(3), range(3)] = x.f
        return out


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

    treatment: ClassVar[Literal["mend", "mask", "note"]] = "note"
    """What is done about its faults: samples are put right, left out, or kept."""

    place: ClassVar[int] = 0
    """Its place among those of the same treatment, where one is found less than
    certainly before another has been dealt with."""

    misread: ClassVar[bool] = False
    """Whether session.toml is wrong and not the samples: a calibration of samples that
    are put right is none of those that the device sends."""

    @abstractmethod
    def find(self, recording: CheckedSamples) -> list[Fault]:
        """Look for it in the samples."""

    def say_repaired(self, fault: Fault) -> str:
        """Sentence for a calibration of samples in which it was undone."""
        return f"{fault.channel}: {self.id} was found and is undone here"


def six(unit_acc: str, acc: float, unit_gyr: str, gyr: float) -> tuple[Param, ...]:
    """Parameters ax ay az gx gy gz with their units and typical sizes."""
    return tuple(Param(f"a{i}", unit_acc, acc) for i in "xyz") + tuple(
        Param(f"g{i}", unit_gyr, gyr) for i in "xyz"
    )
