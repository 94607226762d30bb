"""A fitted set with its residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.rows.averages import Rows
from fieldcal.model.system.linear_rows import LinearRows


@dataclass(frozen=True, slots=True)
class FittedSet:
    """A set at a base state.

    Attributes
    ----------
    rows, dictionary : of the session
    linear : rows of each channel about the state
    values : (k,) of the dictionary's columns in the state
    set : the fitted set

    """

    rows: Rows
    dictionary: Dictionary
    linear: Sequence[LinearRows]
    values: Array
    set: Set

    @property
    def estimate(self) -> Array:
        """Estimate of every column of the dictionary, (k,)."""
        return estimates_by_column(self.set.state, self.dictionary)

    @property
    def deterministic_estimate(self) -> Array:
        """The estimate without random groups, which are not subtracted in residuals."""
        out = self.estimate
        for group in self.dictionary.always:
            if group.random:
                out[group.columns] = 0.0
        for cause, group in self.set.members:
            if cause.kind in ("random", "noise"):
                out[group.columns] = 0.0
        return out

    def residual(self, estimate: Array | None = None) -> Array:
        """Recorded less fitted, (n, 6); nan where nothing was used."""
        estimate = self.estimate if estimate is None else estimate
        out = np.full(self.rows.y.shape, np.nan)
        step = self.values - estimate
        for part in self.linear:
            at = np.flatnonzero(step[part.columns])
            off = part.white + part.design[:, at] @ step[part.columns[at]]
            out[part.rows, part.channel] = off / part.weight
        return out

    @property
    def squares(self) -> Array:
        """Whitened squares of each channel, with its instability as noise, (6,)."""
        return self.squares_of(self.residual())

    def squares_of(self, residual: Array) -> Array:
        """The same for other residuals."""
        tau = self.dictionary.instability_sigma(self.set.sizes.instability)
        out = np.zeros(6)
        for part in self.linear:
            c = part.channel
            white = residual[part.rows, c] * part.weight
            info, mean = part.info, part.window_means(white)
            shared = self.dictionary.window_error[part.windows, c] ** 2 + tau[c] ** 2
            kept = 1 / (1 + info * shared)
            out[c] = float(white @ white) - float((info * mean**2) @ (1 - kept))
        return out

    @property
    def dof(self) -> int:
        """Degrees of freedom: number of rows less effective number of parameters."""
        free = self.set.state
        spent = 1 - np.diag(free.inverse) / free.prior_sigma**2
        return int(sum(len(p.white) for p in self.linear) - round(float(spent.sum())))


def estimates_by_column(state: Eliminated, dictionary: Dictionary) -> Array:
    """Estimates of a set as values of every column of the dictionary, (k,).

    Rotations of positions with unknown orientation are fitted to the residuals; 0 where
    no output depends on them.
    """
    out = np.zeros(dictionary.width)
    np.add.at(out, state.columns, state.estimate)
    if dictionary.unoriented.any() and state.rows.root.size:
        gram, at = state.rows.gram, state.rows.gram.index[state.columns]
        left = state.rows.residual - state.rows.whiten(gram.means[:, :, at]) @ (
            state.estimate
        )
        for j, p in enumerate(dictionary.window_positions):
            if dictionary.unoriented[j]:
                rhs = gram.free_rotations[j].T @ state.rows.root[j].T @ left[j]
                out[dictionary.rotations_of(p)] += priors.SMALL_ROTATION * rhs
    return out
