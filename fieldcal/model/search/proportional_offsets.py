"""Offsets of the windows that all axes of a triad share in one proportion.

If the joints stand at other angles than stated, or the fixture gives way, all axes of a
triad have offsets in one unknown ratio a,

    y_pc = d_p a_c

which is a product of unknowns. Linearised about d0 and a0, with r_j the directions
perpendicular to a0,

    y_pc = d_p a0_c + sum_j t_j d0_p r_jc                                          (1)

so the group has a column for each window and one for each perpendicular direction, and
the unknown ratio costs evidence as any other columns do. d0 and a0 are the leading
singular vectors of the offsets of each axis in each window, given a set. Source:
principal components, and one Gauss-Newton step about them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.unknown_causes import typical_unknown_sizes
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set


def proportional_causes(dictionary: Dictionary, sets: Sequence[Set]) -> Iterator[Cause]:
    """Causes of proportional offsets, about the window offsets beside each set."""
    for part, observed in dictionary.triads:
        if (
            len(observed) < 2
            or len(dictionary.window_positions) <= thresholds.MIN_ALIKE
        ):
            continue
        groups = []
        for fitted in sets:
            offsets = _window_offsets(dictionary, fitted, observed)
            groups.append(_proportional_group(dictionary, part, observed, offsets))
        yield Cause(
            "position", part, priors.UNKNOWN_FUNCTION_CHANCE, tuple(groups), "unknown"
        )


def _window_offsets(d: Dictionary, fitted: Set, channels: Index) -> Array:
    """Offsets of the windows that a set does not explain, in typical sizes, (p, c)."""
    rows = fitted.state.rows.gram.with_instability(
        priors.SIZES[0] * d.typical_instability
    )
    state = Eliminated.of(rows, fitted.state.columns, fitted.state.prior_sigma)
    columns = np.concatenate([d.window_columns(c) for c in channels])
    inner, rhs = state.schur_complement(
        columns, np.repeat(typical_unknown_sizes(d)[channels], len(d.window_positions))
    )
    inner.flat[:: len(columns) + 1] += 1 / priors.SIZES[-1] ** 2
    return np.linalg.solve(inner, rhs).reshape(len(channels), -1).T


def _proportional_group(
    d: Dictionary, part: str, channels: Index, offsets: Array
) -> Group:
    """Group about the leading singular vectors of the offsets."""
    course, size, directions = np.linalg.svd(offsets, full_matrices=False)
    middle = course[:, 0] * np.sqrt(len(offsets))
    directions = directions * typical_unknown_sizes(d)[channels]  # (1), in outputs

    def of(view: RowView) -> Array:
        inside = np.equal.outer(view.x.position, d.window_positions).astype(float)
        out = np.zeros((len(inside), 6, len(offsets) + len(directions) - 1))
        out[:, channels, : len(offsets)] = inside[:, None] * directions[0][:, None]
        out[:, channels, len(offsets) :] = (inside @ middle)[
            :, None, None
        ] * directions[1:].T
        return out

    width = len(offsets) + len(directions) - 1
    at = d.add(General("in proportion", of), width)
    return Group("position", part, at, np.ones(width))
