"""Mismatches without an effect of the catalogue, as input of the sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.found_effects import estimates
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.probabilities import Standing

JOINTS = ("α", "β")

Places = tuple[int, ...]
"""Positions, from 0."""

Errors = tuple[tuple[str, Quantity], ...]
"""Joints, each with the error of its angle, deg."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """A mismatch without an effect.

    Attributes
    ----------
    cause : name of the model's cause: "time", "alpha", "window", "misset" ...
    mismatch : channel, positions and time
    turned : joints, each with the error of its angle that would explain the mismatch

    """

    cause: str
    mismatch: Mismatch
    turned: tuple[tuple[str, Quantity], ...] = ()


def unknown(
    explanation: Explanation, standing: Standing, found: Sequence[Mismatch]
) -> list[Unknown]:
    """Mismatches of one cause, each with the angle errors that would explain it."""
    turned = angle_errors(explanation, standing)
    return [Unknown(standing.name, m, turned.get(m.positions, ())) for m in found]


def angle_errors(explanation: Explanation, standing: Standing) -> dict[Places, Errors]:
    """Errors of angles that were set wrongly, by the positions that have them.

    Only those that stand out of their ±; empty for a cause of another kind.
    """
    if standing.kind != "position":
        return {}
    return {
        one.together or (one.position,): _errors(explanation, one)
        for member in standing.members
        for one in mistakes(explanation, member)
    }


def mistakes(explanation: Explanation, member: Member) -> list[Group]:
    """The single mistakes of a member; of several, those that stand out of their ±."""
    cause, group = member
    parts = [*cause.parts_of(group)]
    if len(parts) == 1:
        return parts  # which need not be of angles
    return [one for one in parts if _errors(explanation, one)] or parts


def _errors(explanation: Explanation, group: Group) -> Errors:
    values, sigmas, _ = estimates(explanation.best.set, group.columns)
    pairs = zip(group.params, np.rad2deg(values), np.rad2deg(sigmas), strict=True)
    return tuple(
        (JOINTS[joint], Quantity(float(v), float(s), "deg"))
        for joint, v, s in pairs
        if abs(v) > thresholds.STANDS_OUT * s
    )


def listed(positions: Sequence[int], most: int | None = None) -> str:
    """Name positions by their numbers, which begin at 1, up to so many.

    >>> listed([3]), listed([0, 1, 2], most=2)
    ('position 4', 'positions 1, 2…')
    """
    word = "position" if len(positions) == 1 else "positions"
    some = ", ".join(str(index + 1) for index in positions[:most])
    return f"{word} {some}" + "…" * (most is not None and len(positions) > most)
