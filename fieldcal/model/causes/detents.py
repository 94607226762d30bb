"""Detents of a fixture: an angle has the same error each time it is set."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import tolerances
from fieldcal.model.causes import columns
from fieldcal.model.causes.basis import CentralDifference, General, RowView
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.physics.experience import Experience
from fieldcal.physics.joint_turns import ANGLE_TOLERANCE_RAD


@dataclass(frozen=True, slots=True)
class Detent:
    """An angle of one joint, and the positions in which it is set.

    Attributes
    ----------
    joint : 0 for alpha, 1 for beta
    angle : set angle, rad
    positions : positions in which this angle is set

    """

    joint: int
    angle: float
    positions: tuple[int, ...]


def detents(x: Experience, oriented: Sequence[int] | Index) -> Iterator[Detent]:
    """Every angle set in the positions `oriented`, including angles set only once."""
    for joint, angle in enumerate((x.alpha, x.beta)):
        first = [float(angle[int(np.argmax(x.position == p))]) for p in oriented]
        for value in sorted(set(np.round(first, 9))):
            pairs = zip(oriented, first, strict=True)
            same = tuple(
                int(p) for p, a in pairs if abs(a - value) < ANGLE_TOLERANCE_RAD
            )
            yield Detent(joint, float(value), same)


def detent_rotations(shared: Sequence[Detent], places: int) -> Array:
    """Rotations of p positions by m detents, (2 p, m): 1 where the angle is set.

    Rows are the angles alpha and beta of each position.
    """
    out = np.zeros((2 * places, len(shared)))
    for k, detent in enumerate(shared):
        out[2 * np.array(detent.positions) + detent.joint, k] = 1.0
    return out


def detent_columns(table: ColumnTable, shared: Sequence[Detent]) -> Index:
    """Append a column, rad, for the error of each detent; their indices, (m,)."""
    rotations = detent_rotations(shared, table.position_count)

    def sides(view: RowView) -> Iterator[CentralDifference]:
        """Inputs for a change of each detent's error, a step up and down."""
        steps = tolerances.ROTATION_STEP_RAD * rotations.T.reshape(len(shared), -1, 2)
        return columns.state_sides(view.nominal, view.state, "small_rotation", steps)

    basis = General(
        "detents", lambda v: columns.small_rotation(v) @ rotations, sides=sides
    )
    return table.add(basis, len(shared))
