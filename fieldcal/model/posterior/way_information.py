"""Information of the accelerometers during turns on some columns, others eliminated.

Rows z = A u + B e + n are whitened; u are the columns wanted, e the others, of standard
deviations S. With P = A^T A - A^T B (S^-2 + B^T B)^-1 B^T A, and b likewise of z, what
remains of the rows is

    |P^1/2 u - P^-1/2 b|^2                                                          (1)

so that another system can have it as rows of its own. If the rows scatter by more than
their noise, (1) is divided by as much. Source: elimination by a Schur complement.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.evidence.sets import Set
from fieldcal.model.system.turn_rows import TurnRows

MIN_EIGENVALUE = 1e-6
"""Part of the largest eigenvalue of P below which rounding made one."""


def way_information(
    fitted: Set, turned: Sequence[TurnRows], wanted: Index
) -> tuple[Array, Array]:
    """Rows (1) of some columns.

    Parameters
    ----------
    fitted : set with the columns and their sizes
    turned : rows of the turns
    wanted : (k,) columns

    Returns
    -------
    (m, k) design and (m,) values, m <= k: none if the turns have no information

    """
    columns, first = np.unique(fitted.state.columns, return_index=True)
    sizes = fitted.state.prior_sigma[first]
    parts = [_way_design(t, columns) for t in turned]
    design = np.vstack([np.zeros((0, len(columns))), *parts])
    white = np.concatenate([np.zeros(0), *(t.way for t in turned)])
    ours = np.isin(columns, wanted)
    a, b = design[:, ours], design[:, ~ours]
    inner = b.T @ b + np.diag(sizes[~ours] ** -2.0)
    solved = np.linalg.solve(inner, b.T @ np.column_stack([a, white]))
    info = a.T @ a - a.T @ b @ solved[:, :-1]
    rhs = a.T @ (white - b @ solved[:, -1])
    size, along = np.linalg.eigh(info)
    kept = size > MIN_EIGENVALUE * max(size.max(initial=0.0), MIN_EIGENVALUE)
    root = np.sqrt(size[kept])
    rows, off = along[:, kept].T * root[:, None], along[:, kept].T @ rhs / root
    left = white @ white - white @ b @ solved[:, -1] - off @ off
    wide = np.sqrt(max(left / max(len(white) - len(columns), 1), 1.0))
    out = np.zeros((len(off), len(wanted)))
    out[:, np.searchsorted(np.sort(wanted), columns[ours])] = rows / wide
    return out, off / wide


def _way_design(turn: TurnRows, columns: Index) -> Array:
    """Design of the way of a turn by all columns of a set, (r, all)."""
    out = np.zeros((len(turn.way), len(columns)))
    shared = np.isin(turn.columns, columns)
    at = np.searchsorted(columns, turn.columns[shared])
    out[:, at] = turn.way_design[:, shared]
    return out
