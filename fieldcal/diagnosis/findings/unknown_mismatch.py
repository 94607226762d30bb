"""Mismatches that no effect of the catalogue explains, as input of the sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fieldcal.core.frames import wrap_angle
from fieldcal.core.samples import Array
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
    exchanged : the two positions whose stated angles are each the other's, if it is
        one of them

    """

    cause: str
    mismatch: Mismatch
    angle_errors: tuple[tuple[str, Quantity], ...] = ()
    exchanged: Places = ()


def unknown_mismatches(
    explanation: Explanation, standing: ProbableCause, found: Sequence[Mismatch]
) -> list[UnknownMismatch]:
    """Mismatches of one cause, each with the angle errors that would explain it."""
    turned = angle_errors(explanation, standing)
    pairs = {
        p: pair for pair in exchanged_positions(explanation, standing) for p in pair
    }
    out = []
    for m in found:
        angles = turned.get(m.positions, ())
        pair = pairs.get(m.positions[0], ()) if m.positions in turned else ()
        out.append(UnknownMismatch(standing.name, m, angles, pair))
    return out


def angle_errors(
    explanation: Explanation, standing: ProbableCause
) -> dict[Places, AngleErrors]:
    """Errors of wrongly set angles, by the positions that have them.

    Only significant errors are included; empty for a cause of another kind.
    """
    if standing.kind != "position":
        return {}
    return {
        error.moved_positions or (error.position,): _errors(explanation, error)
        for member in standing.members
        for error in single_errors(explanation, member)
    }


def exchanged_positions(
    explanation: Explanation, standing: ProbableCause
) -> list[Places]:
    """Pairs of positions of a cause that were held at each other's stated angles."""
    groups = {c.position: g for c, g in standing.members if c.position >= 0}
    stated, held = dict[int, Array](), dict[int, Array]()
    for p, group in groups.items():
        x = explanation.rows.x
        row = int(np.argmax(x.position == p))
        stated[p] = np.array([x.alpha[row], x.beta[row]])
        held[p] = stated[p] + column_estimates(explanation.best.set, group.columns)[0]
    return [
        (p, q)
        for p, q in combinations(sorted(groups), 2)
        if _is_at(held[p], stated[q], stated[p])
        and _is_at(held[q], stated[p], stated[q])
    ]


def _is_at(held: Array, elsewhere: Array, stated: Array) -> bool:
    """Whether angles are those stated elsewhere, and not those stated, rad."""
    off, apart = wrap_angle(held - elsewhere), wrap_angle(held - stated)
    return bool(np.abs(off).max() < thresholds.ALIKE * np.abs(apart).max())


def single_errors(explanation: Explanation, member: Member) -> list[Group]:
    """The single setting errors of a member; of several, only the significant ones."""
    cause, group = member
    parts = [*cause.single_errors_of(group)]
    if len(parts) == 1:
        return parts  # it may be an error other than of an angle
    return [part for part in parts if _errors(explanation, part)] or parts


def _errors(explanation: Explanation, group: Group) -> AngleErrors:
    values, sigmas, _ = column_estimates(explanation.best.set, group.columns)
    pairs = zip(group.params, np.rad2deg(values), np.rad2deg(sigmas), strict=True)
    return tuple(
        (JOINTS[joint], Quantity(float(v), float(s), "deg"))
        for joint, v, s in pairs
        if abs(v) > thresholds.STANDS_OUT * s
    )


def list_positions(positions: Sequence[int], most: int | None = None) -> str:
    """Name positions by their numbers, from 1; three or more in a row as a span.

    Of single ones and spans at most `most` are named.

    >>> list_positions([3]), list_positions([0, 1, 4, 6], most=2)
    ('position 4', 'positions 1, 2…')
    >>> list_positions([0, 1, 2, 3, 7, 9, 10])
    'positions 1 to 4, 8, 10, 11'
    """
    word = "position" if len(positions) == 1 else "positions"
    rows = np.split(positions, 1 + np.flatnonzero(np.diff(positions) != 1))
    named = [
        part
        for row in rows
        for part in (
            [f"{row[0] + 1} to {row[-1] + 1}"]
            if len(row) > 2
            else [str(index + 1) for index in row]
        )
    ]
    return f"{word} {', '.join(named[:most])}" + "…" * (len(named[:most]) < len(named))
