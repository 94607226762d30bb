"""Agreement of the window means with a parameter set.

    S = D + Phi_r L Phi_r^T,   chi2 = min_x (y - Phi x)^T S^-1 (y - Phi x)
    K = (S + Phi V Phi^T)^-1,  r_p = K_pp^-1 (K y)_p                               (1)

D is the covariance of noise and rounding of the means. Phi_r are the columns of random
errors with prior covariance L (errors of set angles, rotations of positions with
unknown orientation), Phi the columns of the estimated parameters with prior covariance
V. For r_p, D also includes the instability from window to window. chi2 uses the stated
noise, and the windows that are not certainly bad; r_p is the residual of a window in a
fit without it. Source: Rasmussen and Williams 2006, 5.4.2, for (1).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model import priors, thresholds, tolerances
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.posterior.mixture import Mixture
from fieldcal.physics.effect import Motion, Sensor
from fieldcal.solve.parameter_set import ParameterSet

WITH_EQUATION = (Motion, Sensor)
"""Kinds of effects that have an equation."""


@dataclass(frozen=True, slots=True)
class LargestResidual:
    """Mean furthest from the prediction by the other windows.

    Attributes
    ----------
    window : number of the window
    axis : 0 to 2 of the triad, -1 for the length of a force of unknown orientation
    residual, sigma : difference and its standard uncertainty, in outputs

    """

    window: int
    axis: int
    residual: float
    sigma: float

    @classmethod
    def of(cls, off: Array, sigma: Array, lengths: Mask) -> LargestResidual | None:
        """Largest residual of (p, 3) in sigmas; `lengths` (p,) marks lengths."""
        far = np.abs(off) / sigma
        if not np.isfinite(far).any():
            return None
        i, c = (int(n) for n in np.unravel_index(np.nanargmax(far), far.shape))
        axis = -1 if lengths[i] else c
        return cls(i, axis, float(off[i, c]), float(sigma[i, c]))


@dataclass(frozen=True, slots=True)
class TriadFit:
    """Agreement of the means of one triad with the fit.

    Attributes
    ----------
    chi2, dof : chi-squared with the stated noise, and degrees of freedom
    rms : root mean square residual, weighted by the windows' noise
    held_out_rms : the same for windows held out of the fit; nan if none could be
    residuals : (p, 3), nan where nothing was measured. A position of unknown
        orientation has one residual, along the force or along the rate of a table
    largest : largest residual of a window held out of the fit; None if there is none

    """

    chi2: float
    dof: int
    rms: float
    held_out_rms: float
    residuals: Array
    largest: LargestResidual | None = None

    @property
    def rejects_model(self) -> bool:
        """Whether the scatter is so large that the model is at fault, not the noise."""
        return self.dof > 0 and not self.chi2 / self.dof < thresholds.WRONG_MODEL


def triad_agreement(
    gram: Gram, d: ParameterSet, fitted: Mixture, channels: tuple[int, ...]
) -> TriadFit:
    """Compare the means of a triad with the estimate."""
    p = len(d.window_positions)
    at = np.ix_(np.arange(p), np.array(channels))
    info, mean_residual = gram.info[at], gram.residual[at]
    used = (info > 0).ravel()
    if not used.any():
        return TriadFit(0.0, 0, np.nan, np.nan, np.full((p, 3), np.nan))
    index = gram.index[fitted.columns]
    means = gram.means[:p, list(channels)][:, :, index].reshape(-1, len(index))[used]
    y = mean_residual.ravel()[used]
    random = _random_columns(d)
    noise = (1 / info.ravel()[used]) + gram.shared[at].ravel()[used] ** 2
    loose = _free_rotations(gram, p, channels)[used]
    wide = means[:, random] * fitted.prior_sigma[random]
    plain = np.diag(noise) + wide @ wide.T
    stated = plain + loose @ loose.T
    free = means[:, ~random]
    # unknown rotations hide the residuals that they can produce
    measured = _MeasuredMeans(gram, d, channels, used)
    good = (fitted.bad <= thresholds.CERTAIN)[measured.window] | (0 not in channels)
    columns = np.hstack([free, loose])[good]
    columns = columns[:, np.any(columns != 0.0, axis=0)]
    chi2, rank = _least_chi2(plain[np.ix_(good, good)], columns, y[good])
    residual = measured.as_table(y - free @ fitted.mean[~random])
    wander = np.diag(np.tile(fitted.scatter[list(channels)] ** 2, p)[used])
    sizes = free * fitted.prior_sigma[~random]
    off, unsure = _held_out_residuals(stated + wander, sizes, y, measured)
    alone = measured.as_table(off, unsure)
    return TriadFit(
        chi2,
        int(good.sum()) - rank,
        measured.rms(residual),
        measured.rms(alone),
        residual,
        LargestResidual.of(
            alone, measured.sigma_table(unsure), measured.freely_rotated
        ),
    )


def _random_columns(d: ParameterSet) -> Mask:
    """Mark columns of random errors, and of known ones of unknown size, (k,)."""
    equations = [
        g for _, g in d.explanations[0].members if isinstance(g.effect, WITH_EQUATION)
    ]
    every = [
        np.full(len(g.columns), g.fixed_size != priors.FREE_SIZE and g not in equations)
        for g in d.groups
    ]
    return np.concatenate(every)


def _free_rotations(gram: Gram, p: int, channels: tuple[int, ...]) -> Array:
    """Columns of the rotations of positions of unknown orientation, (3 p, 2 p)."""
    rotations = gram.free_rotations[:p, list(channels)]
    out = np.zeros((p, 3, p, 2))
    out[np.arange(p), :, np.arange(p)] = rotations
    return out.reshape(3 * p, 2 * p)


def _least_chi2(stated: Array, free: Array, y: Array) -> tuple[float, int]:
    """Least chi2, and the number of free directions that the means determine."""
    root = np.linalg.cholesky(stated)
    white = np.linalg.solve(root, np.column_stack([free, y]))
    a, b = white[:, :-1], white[:, -1]
    length = np.linalg.norm(a, axis=0)
    length = np.where(
        length > tolerances.ROUNDING * length.max(initial=0.0), length, np.inf
    )
    x, _, rank, _ = np.linalg.lstsq(a / length, b, rcond=tolerances.UNDETERMINED)
    rest = b - a / length @ x
    return float(rest @ rest), int(rank)


@dataclass(frozen=True)
class _MeasuredMeans:
    """Means of a triad that were measured.

    Attributes
    ----------
    gram, d, channels : of the windows
    used : (3 p,) whether each mean was

    """

    gram: Gram
    d: ParameterSet
    channels: tuple[int, ...]
    used: Mask

    @property
    def window(self) -> Index:
        """Number of the window of each mean."""
        return np.repeat(np.arange(len(self.d.window_positions)), 3)[self.used]

    def as_table(self, values: Array, unsure: Array | None = None) -> Array:
        """Residuals of the means as a table, (p, 3).

        A position of unknown orientation has one residual, along the force, or along
        the rate of a table with an unknown axis. A force is nan if its variance shows
        that no other window checks it.
        """
        out = np.full((len(self.d.window_positions), 3), np.nan)
        out[np.nonzero(self.used.reshape(-1, 3))] = values
        for i in np.flatnonzero(self.freely_rotated).tolist():
            out[i] = [self._force_direction(i) @ np.nan_to_num(out[i]), np.nan, np.nan]
        if unsure is not None and 0 in self.channels:
            most = thresholds.MAX_PREDICTION_VARIANCE * self.d.unit[0] ** 2
            for i in range(len(out)):
                n = self._directions(i)
                if np.trace(n @ unsure[i] @ n.T) > most:
                    out[i] = np.nan
        return out

    def sigma_table(self, unsure: Array) -> Array:
        """Sigmas of the residuals in `as_table`, from covariances (p, 3, 3)."""
        out = np.full((len(self.d.window_positions), 3), np.nan)
        for i in np.flatnonzero(self.used.reshape(-1, 3).all(axis=1)).tolist():
            n = self._directions(i)
            out[i, : len(n)] = np.sqrt(np.diag(n @ unsure[i] @ n.T))
        return out

    @cached_property
    def freely_rotated(self) -> Mask:
        """Windows whose outputs unknown rotations change, (p,)."""
        held = len(self.d.window_positions)
        loose = self.gram.free_rotations[:held, list(self.channels)]
        return np.asarray(loose.any(axis=(1, 2)))

    def _directions(self, i: int) -> Array:
        """Directions in which a window has residuals, (1 or 3, 3)."""
        return self._force_direction(i)[None] if self.freely_rotated[i] else np.eye(3)

    def _force_direction(self, i: int) -> Array:
        """Direction in which no unknown rotation changes the outputs, (3,).

        Outputs along it give the input along its own direction. It is nan if the input
        is unknown, such as a rate, or if a channel is missing, such as a clipped one.
        """
        d, at = self.d, list(self.channels)
        inputs = d.x.f if 0 in self.channels else d.x.w
        v = inputs[int(np.argmax(d.x.position == d.window_positions[i]))]
        if not v.any() or not (self.gram.info[i, at] > 0).all():
            return np.full(3, np.nan)
        across = np.cross(*self.gram.free_rotations[i][at].T)
        out: Array = across / (across @ (d.unit[at] * v / np.linalg.norm(v)))
        return out

    def rms(self, rows: Array) -> float:
        """Root mean square, weighted by the noise of the windows."""
        weight = self.gram.info[: len(rows), list(self.channels)].copy()
        free = np.flatnonzero(self.freely_rotated)
        weight[free, 0] = weight[free].mean(axis=1)
        known = np.isfinite(rows)
        if not known.any():
            return float("nan")
        return float(np.sqrt(np.average(rows[known] ** 2, weights=weight[known])))


def _held_out_residuals(
    stated: Array, wide: Array, y: Array, measured: _MeasuredMeans
) -> tuple[Array, Array]:
    """Residuals of means in fits without their own window, (1), and covariances."""
    inverse = np.linalg.inv(stated + wide @ wide.T)
    rhs, window = inverse @ y, measured.window
    out, unsure = np.zeros(len(y)), np.zeros((len(measured.d.window_positions), 3, 3))
    for i in np.unique(window):
        own = np.flatnonzero(window == i)
        block = np.linalg.inv(inverse[np.ix_(own, own)])
        out[own] = block @ rhs[own]
        unsure[i, : len(own), : len(own)] = block
    return out, unsure
