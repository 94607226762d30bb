"""Information of the accelerometers during turns on some columns, others eliminated.

The whitened rows are z = A u + B e + n with the wanted parameters u, the other
parameters e of prior standard deviations S, and unit noise n. Elimination of e gives

    P = A^T A - A^T B (S^-2 + B^T B)^-1 B^T A
    b = A^T z - A^T B (S^-2 + B^T B)^-1 B^T z

so that the rows depend on u by

    |P^1/2 u - P^-1/2 b|^2                                                          (1)

Another system of equations can include P^1/2 u = P^-1/2 b as further rows. If the mean
square of the residuals exceeds one, (1) is divided by it. Source: elimination by a
Schur complement.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import tolerances
from fieldcal.model.evidence.sets import Set
from fieldcal.model.system.turn_rows import TurnRows


def turn_force_information(
    fitted: Set, turned: Sequence[TurnRows], wanted: Index
) -> tuple[Array, Array]:
    """Rows (1) of some columns.

    Parameters
    ----------
    fitted : set with the columns and their sizes
    turned : rows of the turns
    wanted : (k,) columns u

    Returns
    -------
    (m, k) design P^1/2 and (m,) values P^-1/2 b; m <= k is the number of directions
    of u on which the turns have information, 0 if there are none

    """
    columns, first = np.unique(fitted.state.columns, return_index=True)
    sizes = fitted.state.prior_sigma[first]
    parts = [_turn_force_design(t, columns) for t in turned]
    design = np.vstack([np.zeros((0, len(columns))), *parts])
    white = np.concatenate([np.zeros(0), *(t.way for t in turned)])
    ours = np.isin(columns, wanted)
    a, b = design[:, ours], design[:, ~ours]
    inner = b.T @ b + np.diag(sizes[~ours] ** -2.0)
    solved = np.linalg.solve(inner, b.T @ np.column_stack([a, white]))
    info = a.T @ a - a.T @ b @ solved[:, :-1]
    rhs = a.T @ (white - b @ solved[:, -1])
    size, along = np.linalg.eigh(info)
    kept = size > tolerances.SINGULAR * max(size.max(initial=0.0), tolerances.SINGULAR)
    root = np.sqrt(size[kept])
    rows, off = along[:, kept].T * root[:, None], along[:, kept].T @ rhs / root
    left = white @ white - white @ b @ solved[:, -1] - off @ off
    wide = np.sqrt(max(left / max(len(white) - len(columns), 1), 1.0))
    out = np.zeros((len(off), len(wanted)))
    out[:, np.searchsorted(np.sort(wanted), columns[ours])] = rows / wide
    return out, off / wide


def _turn_force_design(turn: TurnRows, columns: Index) -> Array:
    """Design (r, c) of the r rows during a turn by the c columns of a set."""
    out = np.zeros((len(turn.way), len(columns)))
    shared = np.isin(turn.columns, columns)
    at = np.searchsorted(columns, turn.columns[shared])
    out[:, at] = turn.way_design[:, shared]
    return out
