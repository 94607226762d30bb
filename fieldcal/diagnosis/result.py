"""The content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array

Verdict = Literal["consistent", "left_out", "ambiguous", "unexplained"]

Kind = Literal[
    "position", "time", "temperature", "spectrum", "transient", "samples", "turn"
]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value with its standard uncertainty and unit; or a text."""

    value: float | str
    sigma: float | None
    unit: str

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        if isinstance(self.value, str):
            return {"value": self.value}
        return {
            "value": json_number(self.value),
            "sigma": json_number(self.sigma),
            "unit": self.unit,
        }


@dataclass(frozen=True, slots=True)
class Mismatch:
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
        out: dict[str, Any] = {
            "channel": self.channel,
            "kind": self.kind,
            "positions": list(self.positions),
            "from_s": json_number(self.from_s),
            "to_s": json_number(self.to_s),
            "covariate": self.covariate,
            "rms": json_number(self.rms),
            "sigma": json_number(self.sigma),
        }
        if np.isfinite(self.share):
            out["correlation"] = json_number(self.correlation)
            out["share"] = json_number(self.share)
        return out


@dataclass(frozen=True, slots=True)
class FoundEffect:
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

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        return {
            "id": self.id,
            "probability": json_number(self.probability),
            "parameters": {n: q.to_json() for n, q in self.parameters.items()},
            "aliases": list(self.aliases),
            "evidence": {n: json_number(v) for n, v in self.evidence.items()},
            "moves": {n: q.to_json() for n, q in self.moves.items()},
        }


@dataclass(frozen=True, slots=True)
class EffectLine:
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

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Quality:
    """How well a model agrees with the recording.

    Attributes
    ----------
    rms : of the residual, in `Diagnosis.unit`
    chi2_per_dof : of the whitened residual
    held_out_rms : residual of rows predicted by a fit that did not include them
    by_channel : held-out rms of each channel, m/s^2 and rad/s

    """

    rms: float
    chi2_per_dof: float
    held_out_rms: float
    by_channel: Mapping[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        return {
            "rms": json_number(self.rms),
            "chi2_per_dof": json_number(self.chi2_per_dof),
            "held_out_rms": json_number(self.held_out_rms),
            "held_out_by_channel": {
                n: json_number(v) for n, v in self.by_channel.items()
            },
        }


@dataclass(frozen=True, slots=True)
class CalibrationGroup:
    """A group of the calibration in device axes, with its change from nominal.

    `value`, `sigma` and `change` are (3,), nan where not determined.
    """

    value: tuple[float, ...]
    sigma: tuple[float, ...]
    change: tuple[float, ...]
    unit: str

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        return {
            "value": [json_number(v) for v in self.value],
            "sigma": [json_number(s) for s in self.sigma],
            "change_sigmas": [
                json_number(c / s) if s > 0 else None
                for c, s in zip(self.change, self.sigma, strict=True)
            ],
            "unit": self.unit,
        }


@dataclass(frozen=True, slots=True)
class Candidate:
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

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        return {
            "id": self.id,
            "delta_chi2": json_number(self.delta_chi2),
            "delta_bic": json_number(self.delta_bic),
            "held_out_gain": json_number(self.held_out_gain),
            "probability": json_number(self.probability),
            "chosen": self.chosen,
            "why": self.why,
        }


@dataclass(frozen=True, slots=True)
class Curve:
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
    position: NDArray[np.intp]
    before: Array
    after: Array
    sigma: Array

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        columns = ("x", "before", "after", "sigma")
        return {
            "channel": self.channel,
            "covariate": self.covariate,
            "unit": self.unit,
            "position": [int(p) for p in self.position],
            **{n: [json_number(v) for v in getattr(self, n)] for n in columns},
        }


@dataclass(frozen=True, slots=True)
class Diagnosis:
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
        return {
            "verdict": self.verdict,
            "probability": json_number(self.probability),
            "mismatch": [m.to_json() for m in self.mismatch],
            "effects": [e.to_json() for e in self.effects],
            "fit": {
                "before": self.before.to_json(),
                "after": self.after.to_json(),
                "unit": self.unit,
            },
            "calibration": {n: g.to_json() for n, g in self.calibration.items()},
            "warnings": list(self.warnings),
            "says": self.says,
            "candidates": [c.to_json() for c in self.candidates],
            "curves": [c.to_json() for c in self.curves],
            "next": list(self.next),
            "lines": [line.to_json() for line in self.lines],
        }


def json_number(value: float | None) -> float | None:
    """A JSON number, or null where there is none."""
    if value is None or not np.isfinite(value):
        return None
    return float(value)
