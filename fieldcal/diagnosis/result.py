"""The content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal

import numpy as np

from fieldcal.core.samples import Array, Index

Verdict = Literal["consistent", "left_out", "ambiguous", "unexplained"]

Kind = Literal[
    "position", "time", "temperature", "spectrum", "transient", "samples", "turn"
]


@dataclass(frozen=True, slots=True)
class Part:
    """A part of diagnosis.json, or all of it."""

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json: every field by its name."""
        return {f.name: _as_json(getattr(self, f.name)) for f in fields(self)}


@dataclass(frozen=True, slots=True)
class Quantity(Part):
    """A value with its standard uncertainty and unit; or a text."""

    value: float | str
    sigma: float | None
    unit: str

    @property
    def sigmas(self) -> float:
        """Size of the value in standard deviations; 0 of a text."""
        if isinstance(self.value, str) or not self.sigma:
            return 0.0
        return abs(self.value) / self.sigma

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        if isinstance(self.value, str):
            return {"value": self.value}
        return Part.to_json(self)


@dataclass(frozen=True, slots=True)
class Mismatch(Part):
    """Where simulation and recording differ.

    Attributes
    ----------
    channel : name in `samples.CHANNELS`, or "t"
    kind : what the difference depends on
    positions : of session.toml, counted from 0
    from_s, to_s : stretch of device time
    covariate : what the difference follows
    rms : size of the residual there, in the channel's unit
    sigma : its significance, standard deviations
    correlation : with the covariate, nan where there is none
    share : part of its variance that a smooth function of the covariate explains

    """

    channel: str
    kind: Kind
    positions: tuple[int, ...]
    from_s: float
    to_s: float
    covariate: str
    rms: float
    sigma: float
    correlation: float = np.nan
    share: float = np.nan

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        out = Part.to_json(self)
        if not np.isfinite(self.share):
            del out["correlation"], out["share"]
        return out


@dataclass(frozen=True, slots=True)
class FoundEffect(Part):
    """An effect of the catalogue that the recording shows.

    Attributes
    ----------
    id : its name in the catalogue
    parameters : by name
    aliases : ids that would explain the same in this recording
    evidence : delta_chi2, delta_bic, held_out_gain, log_evidence
    probability : that it, or one of its aliases, is there
    moves : by how much each parameter of the calibration changes when it is taken into
        account, by full name, each with the sigma that it then has

    """

    id: str
    parameters: Mapping[str, Quantity]
    aliases: tuple[str, ...] = ()
    evidence: Mapping[str, float] = field(default_factory=dict)
    probability: float = 1.0
    moves: Mapping[str, Quantity] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class EffectLine(Part):
    """An effect in one line, in the words of screen and report.

    Attributes
    ----------
    what : its id, and how often it was found
    size : its clearest parameter with its sigma and unit
    sure : its probability
    does : what it does to the calibration

    """

    what: str
    size: str
    sure: str
    does: str


@dataclass(frozen=True, slots=True)
class Quality(Part):
    """How well a model agrees with the recording.

    Attributes
    ----------
    rms : of the residual, in `Diagnosis.unit`
    chi2_per_dof : of the whitened residual
    held_out_rms : residual of rows predicted by a fit that did not include them
    held_out_by_channel : held-out rms of each channel, m/s^2 and rad/s

    """

    rms: float
    chi2_per_dof: float
    held_out_rms: float
    held_out_by_channel: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class CalibrationGroup(Part):
    """A group of the calibration in device axes, with its change from nominal.

    `value`, `sigma` and `change` are (3,), nan where not determined.
    """

    value: tuple[float, ...]
    sigma: tuple[float, ...]
    change: tuple[float, ...]
    unit: str

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        out = Part.to_json(self)
        del out["change"]
        out["change_sigmas"] = [
            json_number(c / s) if s > 0 else None
            for c, s in zip(self.change, self.sigma, strict=True)
        ]
        return out


@dataclass(frozen=True, slots=True)
class Candidate(Part):
    """One explanation that was tried.

    Attributes
    ----------
    id : of the effect
    delta_chi2 : decrease of chi squared with it alone
    delta_bic : the same less ln(rows) for every parameter
    held_out_gain : part of the held-out rms that it removes
    probability : that the recording has it
    chosen : whether it is among the effects found
    why : why it was rejected, in words; empty if it was chosen

    """

    id: str
    delta_chi2: float
    delta_bic: float
    held_out_gain: float
    probability: float
    chosen: bool
    why: str


@dataclass(frozen=True, slots=True)
class Curve(Part):
    """A channel's residual over a covariate.

    Attributes
    ----------
    channel : name in `samples.CHANNELS`
    covariate, unit : what it is drawn over
    x : (m,) the covariate
    position : (m,) of session.toml
    before, after : (m,) residuals, m/s^2 or rad/s
    sigma : (m,) their standard deviation from white noise

    """

    channel: str
    covariate: str
    unit: str
    x: Array
    position: Index
    before: Array
    after: Array
    sigma: Array


@dataclass(frozen=True, slots=True)
class Diagnosis(Part):
    """What the simulation leaves out of a recording, and how well that explains it.

    Attributes
    ----------
    verdict : consistent, left_out, ambiguous or unexplained
    probability : that the verdict is right
    mismatch : where simulation and recording differ
    effects : what is left out
    unit : of the rms values: that of the triad that differs most
    before, after : the simulation without and with the effects
    calibration : with the effects; groups that the recording determines
    warnings : what limits the diagnosis
    says : a paragraph for a person
    candidates : effects that were tried on the windows, and why they were rejected
    curves : residuals over their covariate, before and after
    next : what to do in the field now
    lines : the effects, one line each

    """

    verdict: Verdict
    probability: float
    mismatch: tuple[Mismatch, ...]
    effects: tuple[FoundEffect, ...]
    unit: str
    before: Quality
    after: Quality
    calibration: Mapping[str, CalibrationGroup]
    warnings: tuple[str, ...]
    says: str
    candidates: tuple[Candidate, ...] = ()
    curves: tuple[Curve, ...] = ()
    next: tuple[str, ...] = ()
    lines: tuple[EffectLine, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the content of diagnosis.json."""
        out = Part.to_json(self)
        out["fit"] = {name: out.pop(name) for name in ("before", "after", "unit")}
        return out


def json_number(value: float | None) -> float | None:
    """A JSON number, or null where there is none."""
    if value is None or not np.isfinite(value):
        return None
    return float(value)


def _as_json(value: Any) -> Any:
    """JSON of a field: of what it holds, with null for numbers that are none."""
    if isinstance(value, Part):
        return value.to_json()
    if isinstance(value, Mapping):
        return {name: _as_json(each) for name, each in value.items()}
    if isinstance(value, str | int):
        return value
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Sequence):
        return [_as_json(each) for each in value]
    return json_number(value)
