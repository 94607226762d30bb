"""Biases and scale factors at the end of a recording, where its effects change them.

They are given at the temperature of the last window and with the device at rest, as a
flight would start with them. With the outputs U(f, w) of the added causes at that
instant,

    bias = U(0, 0),   scale_c = [U_c(+d e_c) - U_c(-d e_c)] / 2 d,   d -> 0        (1)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array, Mask
from fieldcal.model import tolerances
from fieldcal.model.causes.basis import Course, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.state import State
from fieldcal.physics.effect import Motion
from fieldcal.physics.experience_rows import select_rows
from fieldcal.physics.joint_turns import JointTurns
from fieldcal.solve.explanations import WeightedExplanation, has_equation
from fieldcal.solve.warm_scales import WARM_SCALE

CHANGING = ("time", "temperature", "force and time", "flicker", WARM_SCALE)
"""Functions without physics whose value at the end belongs to the biases and scale
factors there; functions of angles and forces have no zero."""


@dataclass(frozen=True, slots=True)
class EndValues:
    """Derivatives of the outputs at the end of a recording by k columns.

    Attributes
    ----------
    bias : (6, k) of the outputs without force and rate
    slopes : (6, 6, k) of the slope of an output by an input of f and w, (1)
    sudden : (k,) columns of what began at an instant, as a slip of the device in its
        mount, which is an event and no property of the device

    """

    bias: Array
    slopes: Array
    sudden: Mask

    @property
    def bias_scale(self) -> Array:
        """Of biases and of scale factors, (2, 6, k)."""
        return np.stack([self.bias, self.slopes[range(6), range(6)]])

    def coupling(self, values: Array) -> Array:
        """Slopes by the other axes of a triad, (6, 6), for values (k,).

        What began at an instant is left out.
        """
        same = np.kron(np.eye(2), np.ones((3, 3)) - np.eye(3))
        found: Array = same * (self.slopes @ np.where(self.sudden, 0.0, values))
        return found


def end_values(d: Dictionary, shown: Sequence[WeightedExplanation]) -> EndValues:
    """Biases, scale factors and couplings at the end by the columns of `d`.

    Columns that do not belong to the explanations have 0.
    """
    changing, sudden = np.zeros((2, d.width), dtype=bool)
    for explanation in shown:
        for cause, group in (*explanation.members, *explanation.possible_members):
            if not isinstance(group.effect, Motion) and (
                group.effect is not None or cause.name in CHANGING
            ):
                for each in cause.variants if has_equation(group) else (group,):
                    changing[each.columns] = True
                    sudden[each.columns] = each.begins_at_instant
    slopes = np.zeros((6, 6, d.width))
    if not changing.any():
        return EndValues(slopes[0], slopes, sudden)
    step = tolerances.DERIVATIVE_STEP
    felt = step * np.concatenate([np.zeros((1, 6)), np.eye(6), -np.eye(6)])
    still, *moved = _end_outputs(d, changing, felt)
    slopes = np.stack(moved[:6], axis=1) - np.stack(moved[6:], axis=1)
    return EndValues(still, slopes / (2 * step), sudden)  # (1)


def _end_outputs(d: Dictionary, changing: Mask, felt: Array) -> Array:
    """Outputs by column, (m, 6, k), at the end of the recording for inputs (m, 6).

    The inputs are f and w. The last turn is taken as long ago, so that motion of the
    joints is excluded.
    """
    last, m = int(np.argmax(d.x.t)), len(felt)
    x, rest = select_rows(d.x, [last] * m), float(d.x.lasts[last]) / 2
    nothing = np.zeros((m, 3))
    x = replace(
        x, t=x.t + rest, since_start=x.since_start + rest, lasts=np.zeros(m),
        f=felt[:, :3], w=felt[:, 3:], w_dot=nothing, variance=nothing,
        heating=np.zeros(m), since_turn=np.full(m, np.inf),
        joint_turns=JointTurns.none(),
    )  # fmt: skip
    nowhere = State(
        np.zeros(6), np.ones(6), np.zeros((d.position_count, 2)), np.zeros(3)
    )
    view = RowView(x, x, np.full((len(d.since), m), np.inf), nowhere)
    out = np.zeros((m, 6, d.width))
    for first, end, basis in d.basis_ranges():
        if not changing[first:end].any():
            continue
        table = basis.evaluate(view)
        if isinstance(basis, Course):
            table = np.kron(np.eye(6), table[:, None])
        out[:, :, first:end] = table
    return np.where(changing, out, 0.0)
