"""One turn between two windows, integrated from the gyroscopes.

The turn leads from the window of position p to that of position q and takes the time T.
The gyroscopes have outputs W, bias d and scale factor s. The angular rate against the
Earth is w^ = (W - d)/s - w_earth, from which the other gyroscope errors of the state
are subtracted too. From it the attitude is integrated in steps k of dt,
R_k = exp(-[w^ dt]x) R_{k-1}; R_k takes vectors from device axes at p to device axes at
step k. If the outputs have an error dW, the true attitude is R (I + [phi]x) with

    phi_k = sum_{j<=k} R_j^T dW_j dt / s                                            (1)

phi_T is the closure of the turn. The accelerometers measure during the turn

    f_k = (1 - u) R_k f_p + u R_k R_T^T f_q + R_k ((phi_k - u phi_T) x f_p)          (2)

with f_p and f_q the specific forces in the windows and u the completed part of the
turn, 0 to 1. Rates in rad/s, phi in rad in device axes at p, f in m/s^2. Source:
rotation kinematics to first order in phi.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fieldcal.core.derivative import derivative
from fieldcal.core.rotation import cross_matrix
from fieldcal.core.running_integral import running_integral
from fieldcal.core.samples import Array, Index
from fieldcal.model.turns.attitude import trapezoid_means, turn_geometry
from fieldcal.physics.experience import Experience


@dataclass(frozen=True)
class Turn:
    """One turn, in m fine steps between m + 1 edges, grouped into k pieces.

    Attributes
    ----------
    positions : p and q
    ends : inputs of the device in the rows of the windows
    x : inputs of the device at the edges, by the gyroscopes
    force_without_way_effects : (m + 1, 3) m/s^2, force at the edges without effects
        that act during turns only
    attitude : (m + 1, 3, 3) R at the edges
    done : (m + 1,) u at the edges
    cut : (k + 1,) indices of the edges that bound the pieces
    acc, sd : (k, 3) means of the accelerometers in the pieces, and their standard
        deviations by white noise, units of the output
    closure_sigma : rad, uncertainty of the closure by sampling and sway at its ends
    interval : s between samples
    standing_share : (m + 1, 3) share of the time about each edge in which each
        gyroscope keeps its output of the windows; None unless all windows share a
        rounding error
    rounding_covariance : (3, 3) rad^2, covariance of the closure from rounding while
        the outputs differ from those of the windows; None as above

    """

    positions: tuple[int, int]
    ends: Experience
    x: Experience
    force_without_way_effects: Array
    attitude: Array
    done: Array
    cut: Index
    acc: Array
    sd: Array
    closure_sigma: float
    interval: float
    standing_share: Array | None = None
    rounding_covariance: Array | None = None

    @property
    def t(self) -> Array:
        """Instants of the edges, s."""
        return self.x.t

    @property
    def closure(self) -> Array:
        """The closure phi_T, (3,) rad in device axes at p."""
        return turn_geometry(self.ends, self.positions, self.attitude, self.done)[1]

    def means(self, values: Array) -> Array:
        """Means over the pieces, (k, ...), of values at the edges, (m + 1, ...)."""
        flat = self.piece_weights @ values.reshape(len(values), -1)
        return flat.reshape(-1, *values.shape[1:])

    @cached_property
    def piece_weights(self) -> Array:
        """Weights (k, m + 1) of the values at the edges in the means over the pieces.

        The means are those that the trapezoid rule gives for samples `interval` apart.
        The difference of the rule with steps from edge to edge is removed by the next
        term of Euler and Maclaurin, -dt^2/12 (v'(b) - v'(a)).
        """
        t, each = self.x.t, np.eye(len(self.x.t))
        step = float(np.ptp(t)) / (len(t) - 1)
        slope = np.diff(derivative(t, each)[self.cut], axis=0)
        mean_curvature = slope / np.diff(t[self.cut])[:, None]
        mean = trapezoid_means(t, each, self.cut)
        return mean - (step**2 - self.interval**2) / 12 * mean_curvature

    def weights(self, scale: Array) -> Array:
        """Weights (3, m + 1, 3) of (1), s: axes of the closure, edges, gyroscopes.

        `scale` (3,) are the scale factors of the gyroscopes.
        """
        steps = np.diff(self.x.t)
        seconds = np.zeros(len(self.x.t))  # that each edge stands for, trapezoid rule
        seconds[:-1] += steps / 2
        seconds[1:] += steps / 2
        return np.moveaxis(self.attitude, 2, 0) * seconds[:, None] / scale

    def attitude_error(self, rate_error: Array) -> Array:
        """Attitude errors phi - u phi_T at the edges, (m + 1, 3, k) rad.

        `rate_error` (m + 1, 3, k) are k courses of rate errors dW / s, rad/s.
        """
        at_start = np.swapaxes(self.attitude, 1, 2) @ rate_error  # axes of p
        phi = running_integral(self.x.t, at_start)
        out: Array = phi - self.done[:, None, None] * phi[-1]
        return out

    def force_error(self, phi: Array) -> Array:
        """Force errors R (phi x f_p) at the edges, (m + 1, 3, k) m/s^2, (2).

        `phi` (m + 1, 3, k) are attitude errors, rad in device axes at p.
        """
        force = self.ends.f[self.ends.position == self.positions[0]].mean(axis=0)
        out: Array = (self.attitude @ -cross_matrix(force)) @ phi  # phi x f = -f x phi
        return out
