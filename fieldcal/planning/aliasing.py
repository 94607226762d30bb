"""Effects that a set of positions cannot distinguish, from its design matrix.

The parameters of a calibration (bias and scale factor of each sensor) are projected out
of the columns of every effect. An effect with no remaining column is *hidden*: the
calibration absorbs it. Two effects are *aliases* if the remaining columns of one lie in
the span of the other: cos of the largest principal angle above `ALIKE_COSINE`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.positions import Position, alpha_beta_angles, gamma_angles
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes import columns
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.effect_columns import effect_basis
from fieldcal.model.state import State
from fieldcal.physics.effect import Effect, Motion, Sensor
from fieldcal.physics.experience import Experience

ALIKE_COSINE = 0.995
"""Cosine of an angle at which noise of a few percent hides the difference."""

NOTHING = 1e-6
"""Remaining length of a column, as a part of it, that counts as zero."""


@dataclass(frozen=True, slots=True)
class Aliases:
    """Effects that the positions hide or confuse.

    Attributes
    ----------
    hidden : ids of effects that a calibration absorbs
    pairs : (id, ids it can be mistaken for)

    """

    hidden: tuple[str, ...]
    pairs: tuple[tuple[str, tuple[str, ...]], ...]


def find_aliases(
    positions: Sequence[Position], gravity: float, mounting: Array | None = None
) -> Aliases:
    """Effects at rest that the positions hide or confuse.

    Parameters
    ----------
    positions : with known angles
    gravity : m/s^2
    mounting : (3, 3), procedure = mounting @ device

    """
    x = Experience.at_rest(
        *alpha_beta_angles(positions), gravity,
        gamma=gamma_angles(positions),
        mounting=np.eye(3) if mounting is None else mounting,
    )  # fmt: skip
    perfect = State(np.zeros(6), np.ones(6), np.zeros((0, 2)), np.zeros(3))
    view = RowView.of(x, np.full((1, len(x)), np.inf), perfect)
    base = _calibration(view)
    left: dict[str, Array] = {}
    hidden = []
    for name, effect in catalogue().items():
        seen = _columns(effect, view)
        if seen is None or not np.any(seen):
            continue
        basis = _span(_project_out(seen, base), np.linalg.norm(seen, axis=0).max())
        if basis.shape[1]:
            left[name] = basis
        else:
            hidden.append(name)
    return Aliases(tuple(hidden), tuple(_pairs(left)))


def _columns(effect: Effect, view: RowView) -> Array | None:
    """Columns of an effect in the six outputs at rest, (6n, k); None without any."""
    if effect.shapes or not isinstance(effect, Motion | Sensor) or not effect.params:
        return None
    seen = effect_basis(effect, {}, 0).evaluate(view)
    typical = np.array([p.typical for p in effect.params])
    flat: Array = (seen * typical).reshape(-1, len(typical))
    return flat


def _calibration(view: RowView) -> Array:
    """Columns of bias (both sensors) and scale factor (accelerometers), (6n, 9)."""
    both = [columns.bias(view), columns.scale(view)[:, :, :3]]
    out: Array = np.concatenate(both, axis=2).reshape(-1, 9)
    return out


def _project_out(columns: Array, base: Array) -> Array:
    q = _span(base, np.linalg.norm(base, axis=0).max())
    left: Array = columns - q @ (q.T @ columns)
    return left


def _span(columns: Array, size: float) -> Array:
    """Orthonormal basis of the span of the columns, (m, r)."""
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    basis: Array = u[:, s > NOTHING * size]
    return basis


def _pairs(left: dict[str, Array]) -> list[tuple[str, tuple[str, ...]]]:
    pairs = []
    for name, basis in left.items():
        alike = tuple(
            other
            for other, span in left.items()
            if other != name and _contained(basis, span)
        )
        if alike:
            pairs.append((name, alike))
    return pairs


def _contained(a: Array, b: Array) -> bool:
    """Whether the span of a lies in the span of b."""
    if a.shape[1] > b.shape[1]:
        return False
    return float(np.linalg.svd(a.T @ b, compute_uv=False)[-1]) > ALIKE_COSINE
