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

Nothing in two positions shows how level the base is: a base tilted by t about a level
axis moves a bias by up to g t. `level_sigma` adds that to the covariance.
"""

from __future__ import annotations

import numpy as np

from fieldcal.errors import NotObservable
from fieldcal.frames import force_home
from fieldcal.samples import Array
from fieldcal.solve.design import ladder_remedy
from fieldcal.solve.estimate import NO_DOF, Estimate, axes, not_determined
from fieldcal.solve.linear import Mask
from fieldcal.solve.observations import ACC, Observations
from fieldcal.solve.tilt import RAD, tilted

APART = 1e-4
"""Least difference of specific force between the positions, as a share of gravity."""


def two_position(
    observations: Observations, level_sigma: float = 0.0, as_printed: bool = False
) -> Estimate:
    """Bias and scale factor of the accelerometers, (11)-(14).

    An axis that both positions load alike has no scale factor here, and no bias unless
    both leave it unloaded; the warnings name it and the position that would give it.

    Parameters
    ----------
    observations : two positions with known angles, in any order
    level_sigma : how level the base is, standard uncertainty about each level axis, rad
    as_printed : take (5) and (12) as printed, to compare; k33 has the wrong sign

    Raises
    ------
    NotObservable
        If there are not two known positions, or no axis has a scale factor.

    """
    if len(observations) != 2 or not observations.oriented.all():
        raise NotObservable(
            f"two positions with known angles are needed, not {len(observations)}: "
            "with more of them use the joint estimate"
        )
    g = observations.gravity
    f = printed_forces(observations) if as_printed else observations.forces
    u = observations.mean[:, ACC]
    scaled = np.abs(f[0] - f[1]) > APART * g
    bare = (np.abs(f) < APART * g).all(axis=0) & ~scaled
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
    values = np.einsum("pnc,nc->p", gain, u)
    noise = observations.covariance[:, ACC, ACC]
    covariance = np.einsum("pnc,ncd,qnd->pq", gain, noise, gain)
    aside = np.einsum("pnc,nck->pk", gain, _tilted(observations, values[3:]))
    covariance += level_sigma**2 * aside @ aside.T
    whole = Estimate(
        (*axes("acc_bias"), *axes("acc_scale")),
        values,
        covariance,
        rms=0.0,
        gain=gain,
        warnings=_warnings(observations, scaled, bare, level_sigma, as_printed),
        extra={"level_sigma_deg": float(np.rad2deg(level_sigma))}
        if level_sigma
        else {},
    )
    return whole.only(np.concatenate([scaled | bare, scaled]))


def printed_forces(observations: Observations) -> Array:
    """Reference (5) as printed, in device axes, (n, 3) m/s^2; not for use."""
    f = observations.forces @ observations.mounting.T
    f[:, 2] *= -1.0
    printed: Array = f @ observations.mounting
    return printed


def _tilted(observations: Observations, scale: Array) -> Array:
    """Change of the outputs by a tilt of the base about x and z, (n, 3, 2) per rad."""
    home = force_home(observations.gravity)
    _, by_tilt = tilted(
        "base_tilt", observations.positions, home, observations.mounting, np.zeros(2)
    )
    return scale[:, None] * by_tilt / RAD


def _warnings(
    observations: Observations,
    scaled: Mask,
    bare: Mask,
    level_sigma: float,
    as_printed: bool,
) -> tuple[str, ...]:
    notes = []
    names = (*axes("acc_bias"), *axes("acc_scale"))
    missing = ~np.concatenate([scaled | bare, scaled])
    if missing.any():
        notes.append(
            not_determined(
                [n for n, m in zip(names, missing, strict=True) if m],
                ladder_remedy(observations, missing),
                "these two positions",
            )
        )
    notes.append(NO_DOF)
    if level_sigma == 0:
        notes.append(
            "the base is taken as exactly level: a tilt of 0.1° moves a bias by up to "
            f"{observations.gravity * np.deg2rad(0.1):.3f} m/s^2 unseen; take five "
            "positions, or say how level it is (--level)"
        )
    if as_printed:
        notes.append("as printed: the sign of (5) makes the scale factor of z negative")
    return tuple(notes)
