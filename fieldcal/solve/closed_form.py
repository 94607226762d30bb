"""Accelerometers from two known positions, by the printed formulas.

Position 1 at home, position 2 turned by alpha, beta; U the mean outputs, f the specific
force (4). Per axis the difference of the two positions gives the scale factor and one
position the bias:

    k = (U1 - U2) / (f1 - f2),   b = U1 - k f1

which, with f1 = (0, -g, 0) and f2 = g (-sin a, -cos a cos b, +cos a sin b), is

    Ux0 = Ux1,               k11 = (Ux0 - Ux2) / (g sin a)                 (11) (12)
    Uz0 = Uz1,               k33 = (Uz2 - Uz0) / (g cos a sin b)           (11) (12)
    Uy0 = Uy1 + k22 g,       k22 = (Uy1 - Uy2) / (g (cos a cos b - 1))     (13) (14)

The print has -g cos a sin b in the third line of (5) and with it (Uz0 - Uz2) in
(12), which returns -k33. Source: Avrutov and Pozniak 2023.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.errors import NotObservable
from fieldcal.core.samples import ACC, Array, Mask
from fieldcal.model import thresholds
from fieldcal.model.causes.planned import ACC_CALIBRATION
from fieldcal.solve.observations import Observations


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


def two_position(
    observations: Observations, as_printed: bool = False
) -> ClosedFormEstimate:
    """Bias and scale factor of the accelerometers, (11)-(14).

    An axis that both positions load alike has no scale factor here, and no bias unless
    both leave it unloaded.

    Parameters
    ----------
    observations : two positions with known angles, in any order
    as_printed : take (5) and (12) as printed, to compare; k33 has the wrong sign

    Raises
    ------
    NotObservable
        If there are not two known positions, or no axis has a scale factor.

    """
    if len(observations) != 2 or not observations.oriented.all():
        raise NotObservable(
            f"two positions with known angles are needed, not {len(observations)}"
        )
    g = observations.gravity
    f = printed_forces(observations) if as_printed else observations.forces
    scaled = np.abs(f[0] - f[1]) > thresholds.MIN_FORCE_DIFFERENCE * g
    bare = (np.abs(f) < thresholds.MIN_FORCE_DIFFERENCE * g).all(axis=0) & ~scaled
    if not scaled.any():
        raise NotObservable(
            f"{observations.positions[0].name} and {observations.positions[1].name} "
            "give every accelerometer the same specific force, so they hold no scale "
            "factor: turn the second position, to α = 45°, β = 5° for instance"
        )
    gain = np.zeros((6, 2, 3))
    for axis in range(3):
        if scaled[axis]:
            slope = np.array([1.0, -1.0]) / (f[0, axis] - f[1, axis])
            gain[3 + axis, :, axis] = slope  # (12) (13)
            gain[axis, :, axis] = np.array([1.0, 0.0]) - f[0, axis] * slope  # (11) (14)
        elif bare[axis]:
            gain[axis, :, axis] = 0.5  # (11), both windows
    whole = ClosedFormEstimate.of(ACC_CALIBRATION, gain, observations, ACC)
    return whole.subset(np.concatenate([scaled | bare, scaled]))


def printed_forces(observations: Observations) -> Array:
    """Forces by (5) as printed, with its error, in device axes, (n, 3) m/s^2."""
    f = observations.forces @ observations.mounting.T
    f[:, 2] *= -1.0
    return f @ observations.mounting
