"""Gyroscopes of a device at rest in known positions.

Tactical grade, (36): the mean output is the bias B. The Earth's rate is in it,

    <U> = B + A w_base,   w_base = Omega (c sin psi, -sin phi, c cos psi),  c = cos phi

so it is taken out with what is known of it: the vertical part by the latitude phi, the
level part by the heading psi, or as an unknown of that size where psi is not known.
s = 1 is near enough here, a scale error of 1 % makes 7e-7 rad/s. A is that of the
tilted base as the accelerometers found it, its uncertainty included: one degree turns
1.3e-6 rad/s from one axis to another, ten times what a navigation gyroscope resolves.

Navigation grade, (42)-(48): bias and scale factor from the Earth's rate,

    <U> = B + s w,  w = A Omega (0, -sin phi, cos phi)                          (39)

per axis from two positions (45)-(48), or by least squares from more. The print has
+sin phi in (39)-(41), -sin phi for cos phi in the third line of (40), and sin alpha for
cos alpha in the third line of (41). U, B, w in device axes, rad/s. Source: Avrutov and
Pozniak 2023.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.samples import Array
from fieldcal.solve import linear, scatter
from fieldcal.solve.earth import earth_rate, printed_earth_rate
from fieldcal.solve.estimate import Estimate, axes, not_determined
from fieldcal.solve.observations import GYR, Observations
from fieldcal.solve.tilt import LEVEL, Base

NO_SCALE = (
    "gyr_scale is not determined: the Earth's rate is too weak for it in windows like "
    "these; the turns between the positions give it"
)

USEFUL = 0.1
"""A scale factor less well known than this is not offered."""


def bias(
    observations: Observations,
    heading_sigma: float | None = None,
    as_printed: bool = False,
    base: Base = LEVEL,
) -> Estimate:
    """Bias of tactical gyroscopes, (36), weighted over all positions.

    Parameters
    ----------
    observations : n positions at rest
    heading_sigma : how well z points north, rad; None where it points anywhere
    as_printed : leave the Earth's rate in it
    base : how it is tilted

    """
    n = len(observations)
    known: Array = np.zeros((n, 3))
    unknown: Array = np.zeros((n, 3, 0))
    if not as_printed:
        known, unknown = earth_rate(observations, heading_sigma, base)
    y = observations.mean[:, GYR] - known

    def run(seen: Observations) -> Estimate:
        ones = np.broadcast_to(np.eye(3), (n, 3, 3))
        fit = linear.fit_beside(ones, y, seen.covariance[:, GYR, GYR], unknown)
        return _estimate(axes("gyr_bias"), fit, n)

    return scatter.absorb(run, observations, GYR, "gyroscopes' means")


def bias_and_scale(
    observations: Observations,
    as_printed: bool = False,
    base: Base = LEVEL,
    heading_sigma: float = 0.0,
) -> Estimate:
    """Bias and scale factor of navigation gyroscopes: (45)-(48) for two positions.

    More positions are solved by least squares. `as_printed` takes the reference as
    printed in (40) and (41), to compare; `base` says how the base is tilted,
    `heading_sigma`, rad, how well its z points north.

    A scale factor that the Earth's rate gives to no better than `USEFUL` is left out,
    and with it what the bias owes to it stays in the bias' uncertainty.

    Raises
    ------
    InputError
        If the latitude is not known.

    """
    w: Array = printed_earth_rate(observations) @ observations.mounting
    unknown: Array = np.zeros((len(w), 3, 0))
    if not as_printed:
        w, unknown = earth_rate(observations, heading_sigma, base)
    return scatter.absorb(
        lambda seen: _bias_and_scale(seen, w, unknown),
        observations,
        GYR,
        "gyroscopes' means",
    )


def _bias_and_scale(observations: Observations, w: Array, unknown: Array) -> Estimate:
    n = len(observations)
    y = observations.mean[:, GYR]
    ones = np.broadcast_to(np.eye(3), (n, 3, 3))
    design = np.concatenate([ones, w[:, :, None] * np.eye(3)], axis=2)
    fit = linear.fit_beside(design, y, observations.covariance[:, GYR, GYR], unknown)
    names = (*axes("gyr_bias"), *axes("gyr_scale"))
    out = _estimate(names, fit, n)
    scale = np.array([name.startswith("gyr_scale") for name in out.names])
    weak = scale & (np.sqrt(np.diag(out.covariance)) > USEFUL)
    notes = []
    missing = [n for n, d in zip(names, fit.determined, strict=True) if not d]
    if missing:
        notes.append(not_determined(missing, (), "the Earth's rate in these positions"))
    if weak.any():
        worst = np.sqrt(np.diag(out.covariance))[weak].max()
        notes.append(
            f"the Earth's rate gives the gyroscopes' scale factor only to "
            f"±{100 * worst:.0f} % in these windows, so it is left out: average "
            "longer, or integrate turns between the positions"
        )
    return replace(out.only(~weak), warnings=tuple(notes))


def _estimate(names: tuple[str, ...], fit: linear.LinearFit, n: int) -> Estimate:
    residual = fit.residual[np.isfinite(fit.residual)]
    rms = float(np.sqrt(np.mean(residual**2)))
    whole = Estimate(
        names, fit.values, fit.covariance, fit.chi2, fit.dof, rms,
        fit.gain.reshape(len(names), n, 3),
    )  # fmt: skip
    return whole.only(fit.determined)
