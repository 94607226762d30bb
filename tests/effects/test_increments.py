"""Increments of a device that turns evenly, integrated exactly, on either side."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array
from fieldcal.effects.increments import Increments
from fieldcal.physics.experience import Experience

RATE = np.array([0.7, -0.4, 1.1])
NODE, WEIGHT = np.polynomial.legendre.leggauss(12)


def force(t: Array) -> Array:
    """Specific force in device axes, (n, 3)."""
    phase = np.multiply.outer(t, [2.0, 3.0, 1.5])
    out: Array = np.array([2.0, -9.0, 3.0]) + [3.0, 1.0, 2.0] * np.sin(phase)
    return out


def incremented(t: Array, interval: float) -> Array:
    """Mean over an interval about t, in the axes at its start; at its end if < 0."""
    out = np.zeros((len(t), 3))
    for node, weight in zip(NODE, WEIGHT / 2, strict=True):
        later = node * abs(interval) / 2
        axes = Rotation.from_rotvec(RATE * (later + interval / 2))
        out += weight * axes.apply(force(t + later))
    return out


def inputs(t: Array, interval: float = 0.0) -> Experience:
    """What a reference tells, with increments if there is an interval."""
    h = 1e-3
    low, at, high = (incremented(t + d, interval) for d in (-h, 0.0, h))
    n = len(t)
    x = Experience.at_rest(np.zeros(n), np.zeros(n), 9.8, rate=np.tile(RATE, (n, 1)),
                           f_dot=(high - low) / (2 * h),
                           f_bend=(high - 2 * at + low) / h**2)  # fmt: skip
    return Experience(**{k: getattr(x, k) for k in x.__slots__} | {"f": at})


@pytest.mark.parametrize("interval", [0.04, -0.04])
def test_all_terms_to_the_square_of_the_interval_are_there(interval: float) -> None:
    t = np.linspace(0.0, 3.0, 40)
    values = np.array([interval / 2, interval**2 / 12])
    for one in (1.0, 0.5):
        by = values * [one, one**2]
        found = Increments().change_of_outputs(inputs(t), by)[:, :3]
        left = np.abs(incremented(t, one * interval) - force(t) - found).max()
        assert left < 8e-5 * one**3  # the rest goes as the cube
    linear = values[0] * np.cross(RATE, force(t))
    assert np.abs(incremented(t, interval) - force(t) - linear).max() > 3e-3


@pytest.mark.parametrize("interval", [0.04, -0.04])
def test_increments_of_the_reference_are_undone(interval: float) -> None:
    t = np.linspace(0.0, 3.0, 40)
    values = -np.array([interval / 2, interval**2 / 12])
    for one in (1.0, 0.5):
        x = inputs(t, one * interval)
        found = Increments().change_of_outputs(x, values * [one, one**2])[:, :3]
        assert np.abs(force(t) - x.f - found).max() < 4e-5 * one**3
