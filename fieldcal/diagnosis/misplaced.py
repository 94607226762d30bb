"""A position that is off by itself: whether it only was set at other angles.

Of the mean d of a window's accelerometers, less what the rest of the recording makes of
them, the joints' angles explain A theta; with V the covariance of d, white noise and
what the rest leaves open,

    theta = (A^T V^-1 A + 1 / WIDEST^2)^-1 A^T V^-1 d

about which it is done again: a degree is no small angle for a good accelerometer.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.result import Quantity
from fieldcal.samples import Array

WIDEST = np.deg2rad(20.0)
"""How far off an angle may have been set, rad; so that one that does nothing is 0."""

ANEW = 4
STANDS = 3.5
JOINTS = ("alpha", "beta")


class Turned(NamedTuple):
    """By how much the angle of a joint was another than the one that was said."""

    joint: str
    angle: Quantity


def misplaced(bench: Bench, fit: Fit, position: int) -> tuple[Turned, ...]:
    """Angles that a position was set at otherwise; none if they do not explain it.

    Parameters
    ----------
    bench : rows, the position's own offset among their errors
    fit : in them
    position : number of the window, in the order of time

    """
    rows = bench.rows
    used = rows.used[rows.x.position == position, :3]
    if not (rows.x.oriented.all() and used.any(axis=0).all()):
        return ()
    weight, v = _averaged(bench, fit, position)
    theta = step = np.zeros(2)
    for _ in range(ANEW):
        d, a = _off(bench, fit, position, weight, theta)
        pull = np.linalg.solve(v, a)
        covariance = np.linalg.inv(a.T @ pull + np.eye(2) / WIDEST**2)
        step = covariance @ (pull.T @ d - theta / WIDEST**2)
        theta = theta + step
    left = d - a @ step
    if left @ np.linalg.solve(v, left) > STANDS**2:
        return ()
    size, sigma = np.rad2deg(theta), np.rad2deg(np.sqrt(np.diag(covariance)))
    return tuple(
        Turned(joint, Quantity(float(t), float(s), "deg"))
        for joint, t, s in zip(JOINTS, size, sigma, strict=True)
        if abs(t) > STANDS * s
    )


def _averaged(bench: Bench, fit: Fit, position: int) -> tuple[Array, Array]:
    """Weights of a window's rows in its mean, (n, 3), and that mean's covariance V."""
    rows = bench.rows
    inside = rows.x.position == position
    use = rows.used[inside, :3]
    weight = np.where(use, 1 / np.where(use, rows.sd[inside, :3], 1.0) ** 2, 0.0)
    total = weight.sum(axis=0)
    weight = weight / total
    free = np.einsum("ic,ick->ck", weight, fit.design[inside, :3])
    shared = rows.common[inside, :3][0] ** 2
    return weight, np.diag(1 / total + shared) + free @ fit.covariance @ free.T


def _off(
    bench: Bench, fit: Fit, position: int, weight: Array, theta: Array
) -> tuple[Array, Array]:
    """Mean d (3,) that a window is off by once turned by theta, and A (3, 2) there."""
    rows = bench.rows
    inside = rows.x.position == position
    aside = np.resize(fit.state.aside, (bench.places, 2))
    aside[position] += theta
    state = replace(fit.state, aside=aside)
    apart = (rows.y - state.predict(rows.x))[inside, :3]
    own = bench.aside(state)[inside, :3, 2 * position : 2 * position + 2]
    d = (weight * np.where(weight > 0, apart, 0.0)).sum(axis=0)
    return d, np.einsum("ic,icj->cj", weight, own)
