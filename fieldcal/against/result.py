"""The result of a comparison: the content of against.json."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from fieldcal.diagnosis.result import Mismatch, Quantity, Verdict, json_number
from fieldcal.effects import catalogue

Direction = Literal["left_out", "added", "resized"]
"""Only the recording has it; only the simulator; both, with different sizes."""


@dataclass(frozen=True, slots=True)
class RealAndSimulated:
    """One quantity in recording and simulator; None where it is absent.

    `difference` is recording less simulator, with the uncertainty of both.
    """

    real: Quantity | None
    simulator: Quantity | None
    difference: Quantity

    @classmethod
    def of(cls, real: Quantity | None, simulator: Quantity | None) -> RealAndSimulated:
        """Values with their difference; an absent value counts as exactly 0.

        Raises
        ------
        ValueError
            If neither is there.

        """
        there = [q for q in (real, simulator) if q is not None]
        if not there:
            raise ValueError("neither is known")
        one, two = (0.0 if q is None else float(q.value) for q in (real, simulator))
        sigmas = [q.sigma for q in there if q.sigma is not None]
        sigma = math.hypot(*sigmas) if len(sigmas) == len(there) else None
        return cls(real, simulator, Quantity(one - two, sigma, there[0].unit))

    def to_json(self) -> dict[str, Any]:
        """Return the object of against.json."""
        return {
            "real": None if self.real is None else self.real.to_json(),
            "simulator": None if self.simulator is None else self.simulator.to_json(),
            "difference": self.difference.to_json(),
        }


@dataclass(frozen=True, slots=True)
class Difference:
    """One difference between recording and simulator.

    Attributes
    ----------
    id : an effect of the catalogue, a group of the calibration, "noise", or what an
        unexplained mismatch follows
    direction : which of the two has it
    probability : that they differ in it
    parameters : by name
    aliases : other effects that explain it as well
    where : channel, positions, time and covariate, in the one that has it
    shown : whether the other recording could have shown it
    explained : whether it is an effect of the catalogue or a known quantity
    direction_probability : of the direction, given that they differ: a simulator may
        have so little of an effect that its output does not tell it from nothing

    """

    id: str
    direction: Direction
    probability: float
    parameters: Mapping[str, RealAndSimulated]
    aliases: tuple[str, ...] = ()
    where: tuple[Mismatch, ...] = ()
    shown: bool = True
    explained: bool = True
    direction_probability: float = 1.0

    @property
    def sizes(self) -> dict[str, RealAndSimulated]:
        """Parameters other than instants, frequencies and time constants."""
        effect = catalogue().get(self.id)
        shapes = {shape.name for shape in effect.shapes} if effect else ()
        return {n: p for n, p in self.parameters.items() if n not in shapes}

    def to_json(self) -> dict[str, Any]:
        """Return the object of against.json."""
        return {
            "id": self.id,
            "direction": self.direction,
            "direction_probability": json_number(self.direction_probability),
            "probability": json_number(self.probability),
            "parameters": {n: p.to_json() for n, p in self.parameters.items()},
            "aliases": list(self.aliases),
            "where": [m.to_json() for m in self.where],
            "shown": self.shown,
            "explained": self.explained,
        }


def verdict_of(differences: Sequence[Difference]) -> Verdict:
    """The verdict that follows from the differences."""
    if any(not d.explained for d in differences):
        return "unexplained"
    if any(d.aliases for d in differences):
        return "ambiguous"
    return "left_out" if differences else "consistent"


@dataclass(frozen=True, slots=True)
class SimulatorPrediction:
    """How a simulator predicts a recording that it was not fitted to.

    Attributes
    ----------
    rms_acc, rms_gyr : over parts of windows, m/s^2 and rad/s; nan where none
    chi2_per_dof : of what was predicted, its uncertainty counted

    """

    rms_acc: float
    rms_gyr: float
    chi2_per_dof: float

    def to_json(self) -> dict[str, Any]:
        """Return the object of against.json."""
        return {name: json_number(value) for name, value in asdict(self).items()}


@dataclass(frozen=True, slots=True)
class Facts:
    """Properties of a recording.

    Attributes
    ----------
    rate_hz : samples a second
    step_acc, step_gyr : least change of an output, m/s^2 and rad/s; nan where none
    start_s : first sample, s of device time
    start_c : temperature at the start, deg C; nan where unknown
    noise : by channel, from sample to sample at rest, m/s^2 and rad/s
    calibration : by group and axis
    effects : parameters of those with an equation, by id

    """

    rate_hz: float
    step_acc: float
    step_gyr: float
    start_s: float
    start_c: float
    noise: Mapping[str, Quantity]
    calibration: Mapping[str, Mapping[str, Quantity]] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, Quantity]] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the object of against.json."""
        return {
            "rate_hz": json_number(self.rate_hz),
            "step_acc": json_number(self.step_acc),
            "step_gyr": json_number(self.step_gyr),
            "start_s": json_number(self.start_s),
            "start_c": json_number(self.start_c),
            "noise": _quantities(self.noise),
            "calibration": {n: _quantities(g) for n, g in self.calibration.items()},
            "effects": {n: _quantities(e) for n, e in self.effects.items()},
        }


def _quantities(some: Mapping[str, Quantity]) -> dict[str, Any]:
    return {name: quantity.to_json() for name, quantity in some.items()}


@dataclass(frozen=True, slots=True)
class Aligned:
    """Alignment of two recordings of one motion.

    Attributes
    ----------
    delay : by which the recording's clock is ahead of the simulator's, at `at_s`
    drift : relative rate by which the simulator's clock is faster
    turn : rotation from the simulator's axes to the recording's, about x, y and z
    at_s : instant of the delay, s of the recording's clock
    compared_s : duration of the common motion, s

    """

    delay: Quantity
    drift: Quantity
    turn: Mapping[str, Quantity]
    at_s: float
    compared_s: float

    def to_json(self) -> dict[str, Any]:
        """Return the object of against.json."""
        return {
            "delay": self.delay.to_json(),
            "drift": self.drift.to_json(),
            "turn": _quantities(self.turn),
            "at_s": json_number(self.at_s),
            "compared_s": json_number(self.compared_s),
        }


@dataclass(frozen=True, slots=True)
class Match:
    """Comparison of a recording with a simulator's output.

    Attributes
    ----------
    verdict : consistent, left_out, ambiguous or unexplained
    probability : that the verdict is right
    differences : the most probable first
    alike : ids of what both have with the same size
    before, after : prediction of the recording by the simulator as it is, and with the
        differences found; then each position is held out
    real, simulator : properties of each recording
    warnings : what limits the comparison
    says : a paragraph for the user
    aligned : alignment of two recordings of one motion; None if positions are compared

    """

    verdict: Verdict
    probability: float
    differences: tuple[Difference, ...]
    alike: tuple[str, ...]
    before: SimulatorPrediction
    after: SimulatorPrediction
    real: Facts
    simulator: Facts
    warnings: tuple[str, ...]
    says: str
    aligned: Aligned | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the content of against.json."""
        return {
            "verdict": self.verdict,
            "probability": json_number(self.probability),
            "differences": [d.to_json() for d in self.differences],
            "alike": list(self.alike),
            "prediction": {
                "before": self.before.to_json(),
                "after": self.after.to_json(),
            },
            "recordings": {
                "real": self.real.to_json(),
                "simulator": self.simulator.to_json(),
            },
            "warnings": list(self.warnings),
            "says": self.says,
        } | ({} if self.aligned is None else {"alignment": self.aligned.to_json()})
