"""Angles from which to linearise a position that was set at quite another angle.

Linearised about the stated angle, a position that lies far from it may converge to a
wrong one, such as the mirror image of the right one. The force that its windows show
tells where it was; most often that is where another position should have been.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.frames import in_procedure_axes, wrap_angle
from fieldcal.core.samples import ACC, Array
from fieldcal.model import resolutions, thresholds
from fieldcal.model.rows.averages import Rows
from fieldcal.model.state import State
from fieldcal.physics.experience import Experience


def starting_angles(rows: Rows, nominal: State, position: int) -> Array:
    """Change of alpha and beta to where a position's mean force is, (2,) rad.

    Zero where the stated angles are near enough, or nothing was measured.
    """
    x = rows.x
    own = np.flatnonzero(x.position == position)
    force = (rows.y[own][:, ACC] - nominal.bias[ACC]) / nominal.scale[ACC]
    axes = np.isfinite(force).all(axis=0)
    stated = np.array([x.alpha[own[0]], x.beta[own[0]]])
    if axes.sum() < 2 or not np.isfinite(stated).all():
        return np.zeros(2)
    measured = force.mean(axis=0)

    def errors(angles: Array) -> Array:
        """Differences of forces at some angles (k, 2) from the mean, of gravity."""
        off = _forces(x, int(own[0]), angles) - measured
        apart: Array = np.linalg.norm(off[:, axes], axis=1) / x.gravity
        return apart

    if errors(stated[None])[0] <= thresholds.CONVERGES_WITHIN_RAD:
        return np.zeros(2)
    others = _stated_elsewhere(x, position)
    off = errors(others)
    if len(others) and off.min() <= thresholds.CONVERGES_WITHIN_RAD:
        nearest: Array = _turn(stated, others)[off.argmin()]
        return nearest
    grid = _grid()
    off = errors(grid)
    likely = _turn(stated, grid[off <= off.min() + thresholds.ALIKE])
    least: Array = likely[np.abs(likely).sum(axis=1).argmin()]
    return least


def _forces(x: Experience, row: int, angles: Array) -> Array:
    """Specific force in device axes at some angles (k, 2), as in a row, (k, 3)."""
    third = np.full(len(angles), x.gamma[row]) if x.gamma.any() else None
    force = in_procedure_axes(angles[:, 0], angles[:, 1], x.base_force, third)
    return np.asarray(force @ x.mounting, float)


def _stated_elsewhere(x: Experience, position: int) -> Array:
    """Stated angles of all other positions, (k, 2) rad."""
    other = x.oriented & (x.position >= 0) & (x.position != position)
    return np.unique(np.column_stack([x.alpha, x.beta])[other], axis=0)


def _turn(stated: Array, angles: Array) -> Array:
    """Turns from the stated angles to others (k, 2), each at most half a turn, rad."""
    return wrap_angle(angles - stated)


def _grid() -> Array:
    """All orientations in steps, (k, 2) rad."""
    alpha = np.arange(-180.0, 180.0, resolutions.GRID_STEP_DEG)
    beta = np.arange(
        -90.0, 90.0 + resolutions.GRID_STEP_DEG / 2, resolutions.GRID_STEP_DEG
    )
    pairs = np.meshgrid(alpha, beta, indexing="ij")
    grid: Array = np.deg2rad(np.stack(pairs, axis=-1).reshape(-1, 2))
    return grid
