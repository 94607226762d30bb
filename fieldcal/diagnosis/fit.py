"""A model of the rows at its optimum: estimates, covariance, residual, evidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.model import State, Term
from fieldcal.samples import Array


@dataclass(frozen=True, slots=True)
class Fit:
    """A model at its optimum.

    Attributes
    ----------
    state : the estimates
    names : of each column: "acc_bias.x", "base_tilt.about_x_deg", "aside.0.alpha" ...
    values : (k,) estimates, effects without what the simulation has already
    covariance : (k, k)
    determined : (k,) columns that the rows say something about
    residual : (n, 6) outputs less prediction
    white : (n, 6) the same, whitened
    jacobian : (n, 6, k), whitened
    design : (n, 6, k), the same before
    chi2, dof : of the whitened residual
    score : ln Z but for a constant that all models of the same rows share

    """

    state: State
    names: tuple[str, ...]
    values: Array
    covariance: Array
    determined: NDArray[np.bool_]
    residual: Array
    white: Array
    jacobian: Array
    design: Array
    chi2: float
    dof: int
    score: float

    @property
    def sigma(self) -> Array:
        """Standard uncertainty of each column, (k,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def terms(self) -> tuple[Term, ...]:
        """The effects in the model."""
        return self.state.terms

    def column(self, name: str) -> int:
        """Index of a column by its name."""
        return self.names.index(name)
