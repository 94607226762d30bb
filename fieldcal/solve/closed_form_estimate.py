"""Estimate by a printed formula: parameters that are linear in the means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.solve.observations import Mask, Observations


@dataclass(frozen=True, slots=True)
class ClosedFormEstimate:
    """Parameters with the covariance that follows from that of the windows.

    Attributes
    ----------
    names : (p,) full names, ``group.component``
    values, covariance : (p,), (p, p)

    """

    names: tuple[str, ...]
    values: Array
    covariance: Array

    @classmethod
    def of(
        cls,
        names: Sequence[str],
        gain: Array,
        observations: Observations,
        channels: slice,
    ) -> ClosedFormEstimate:
        """Make the estimate from derivatives (p, n, 3) by the means of a triad."""
        noise = observations.covariance[:, channels, channels]
        values = np.einsum("pnc,nc->p", gain, observations.mean[:, channels])
        covariance = np.einsum("pnc,ncd,qnd->pq", gain, noise, gain)
        return cls(tuple(names), values, covariance)

    def subset(self, kept: Mask) -> ClosedFormEstimate:
        """Keep some of the parameters, (p,) bool."""
        rows = np.flatnonzero(kept)
        return replace(
            self,
            names=tuple(self.names[i] for i in rows),
            values=self.values[rows],
            covariance=self.covariance[np.ix_(rows, rows)],
        )
