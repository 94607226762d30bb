"""Mismatches that no effect of the catalogue explains, as input of the sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.found_effects import column_estimates
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.probabilities import ProbableCause

JOINTS = ("α", "β")

Places = tuple[int, ...]
"""Positions, from 0."""

AngleErrors = tuple[tuple[str, Quantity], ...]
"""Joints, each with the error of its angle, deg."""


@dataclass(frozen=True, slots=True)
class UnknownMismatch:
    """A mismatch that no effect explains.

    Attributes
    ----------
    cause : name of the model's cause: "time", "alpha", "window", "misset" ...
    mismatch : channel, positions and time
    angle_errors : joints, each with the error of its angle that would explain it

    """

    cause: str
    mismatch: Mismatch
    angle_errors: tuple[tuple[str, Quantity], ...] = ()


def unknown_mismatches(
    explanation: Explanation, standing: ProbableCause, found: Sequence[Mismatch]
) -> list[UnknownMismatch]:
    """Mismatches of one cause, each with the angle errors that would explain it."""
    turned = angle_errors(explanation, standing)
    return [
        UnknownMismatch(standing.name, m, turned.get(m.positions, ())) for m in found
    ]


def angle_errors(
    explanation: Explanation, standing: ProbableCause
) -> dict[Places, AngleErrors]:
    """Errors of wrongly set angles, by the positions that have them.

    Only significant errors are included; empty for a cause of another kind.
    """
    if standing.kind != "position":
        return {}
    return {
        one.moved_positions or (one.position,): _errors(explanation, one)
        for member in standing.members
        for one in single_errors(explanation, member)
    }


def single_errors(explanation: Explanation, member: Member) -> list[Group]:
    """The single setting errors of a member; of several, only the significant ones."""
    cause, group = member
    parts = [*cause.single_errors_of(group)]
    if len(parts) == 1:
        return parts  # it may be an error other than of an angle
    return [one for one in parts if _errors(explanation, one)] or parts


def _errors(explanation: Explanation, group: Group) -> AngleErrors:
    values, sigmas, _ = column_estimates(explanation.best.set, group.columns)
    pairs = zip(group.params, np.rad2deg(values), np.rad2deg(sigmas), strict=True)
    return tuple(
        (JOINTS[joint], Quantity(float(v), float(s), "deg"))
        for joint, v, s in pairs
        if abs(v) > thresholds.STANDS_OUT * s
    )


def list_positions(positions: Sequence[int], most: int | None = None) -> str:
    """Name positions by their numbers, counted from 1; at most `most` of them.

    >>> list_positions([3]), list_positions([0, 1, 2], most=2)
    ('position 4', 'positions 1, 2…')
    """
    word = "position" if len(positions) == 1 else "positions"
    some = ", ".join(str(index + 1) for index in positions[:most])
    return f"{word} {some}" + "…" * (most is not None and len(positions) > most)
