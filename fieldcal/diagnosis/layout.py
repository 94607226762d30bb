"""Which columns a fit of the rows has, and in what order.

Biases and scale factors that the rows can show, what is free of the effects, and two
small turns of every position whose angles are not known for sure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.model import State, Term
from fieldcal.samples import Array

GROUPS = ("acc_bias", "gyr_bias", "acc_scale", "gyr_scale")


@dataclass(frozen=True, slots=True)
class Layout:
    """Columns of a fit.

    Attributes
    ----------
    base : (12,) biases, then scale factors, that are estimated
    loose : (l,) positions with turns of their own

    """

    base: NDArray[np.bool_]
    loose: NDArray[np.intp]

    def names(self, terms: Sequence[Term]) -> tuple[str, ...]:
        """Name of each column."""
        base = np.array([f"{group}.{axis}" for group in GROUPS for axis in "xyz"])
        names = list(base[self.base])
        for term in terms:
            names += [f"{term.effect.id}.{name}" for name in term.names]
        names += [f"aside.{p}.{j}" for p in self.loose for j in range(2)]
        return tuple(names)

    def pack(self, state: State) -> Array:
        """Values of the columns in a state."""
        base = np.concatenate([state.bias, state.scale])[self.base]
        aside = state.aside[self.loose] if len(self.loose) else np.empty(0)
        return np.concatenate([base, *state.values, aside.ravel()])

    def unpack(self, state: State, p: Array) -> State:
        """The state with some values of the columns."""
        base = np.concatenate([state.bias, state.scale])
        k = int(self.base.sum())
        base[self.base] = p[:k]
        values = []
        for v in state.values:
            values.append(p[k : k + len(v)])
            k += len(v)
        aside = state.aside.copy()
        if len(self.loose):
            aside[self.loose] = p[k:].reshape(-1, 2)
        return State(base[:6], base[6:], state.terms, tuple(values), aside)
