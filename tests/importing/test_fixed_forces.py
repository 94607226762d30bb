"""Accelerations that do not turn with the device, and rests, which look alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import G, turned, write

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.units.fixed_forces import forces_are_fixed
from fieldcal.importing.units.gravity_size import GravityReading

ROWS = turned(49, 50.0, 2.0)
READS = GravityReading(G, np.zeros(3), False)


def upright(many: int, seed: int) -> Array:
    """Forces (n, 3) of which gravity stays on z."""
    rng = np.random.default_rng(seed)
    return np.array([0.0, 0.0, G]) + rng.normal(0, 0.02, (many, 3))


@pytest.mark.parametrize("unit", ["", "deg/s", "rad/s"])
def test_forces_in_the_frame_of_the_earth_are_asked_about(
    unit: str, tmp_path: Path
) -> None:
    table = ROWS.copy()
    table[:, 1:4] = upright(len(table), 1)
    table[:, 4:] = np.rad2deg(table[:, 4:]) if unit == "deg/s" else table[:, 4:]
    axes = ",".join(f"g{axis} ({unit})" if unit else f"g{axis}" for axis in "xyz")
    path = write(tmp_path, table, heading=f"t,ax,ay,az,{axes}")
    # of a stated unit, that gravity does not turn may be said first
    with pytest.raises(InputError, match="stay as they are|gravity would turn"):
        read_files([path])
    block, _ = read_files([path], ReadOptions(gyr_unit=unit or "rad/s"))
    assert len(block) == len(ROWS)


@given(
    st.integers(0, 1000), st.floats(1e-4, 0.02), st.floats(0, 0.01), st.floats(0, 0.1),
    st.floats(0, 3),
)  # fmt: skip
def test_noise_drift_bias_and_turns_about_the_vertical_are_none(
    seed: int, noise: float, drift: float, bias: float, turn: float
) -> None:
    rng, t = np.random.default_rng(seed), np.arange(3000) / 50
    gyr = rng.normal(0, noise, (len(t), 3)) + bias
    gyr += drift * (1 - np.exp(-t / 20))[:, None]
    gyr[:, 2] += turn * np.sin(t)
    assert not forces_are_fixed(t, upright(len(t), seed), gyr, READS)


@given(st.integers(0, 1000), st.floats(0.05, 3))
def test_turns_that_gravity_shows_are_none(seed: int, size: float) -> None:
    t = np.arange(3000) / 50
    angle = 0.3 * size * np.sin(0.7 * t)
    rng = np.random.default_rng(seed)
    acc = G * np.column_stack([0 * t, np.sin(angle), np.cos(angle)])
    acc += rng.normal(0, 0.02, acc.shape)
    gyr = np.column_stack([np.gradient(angle, t), 0 * t, 0 * t])
    gyr += rng.normal(0, 1e-3, gyr.shape)
    assert not forces_are_fixed(t, acc, gyr, READS)
    assert forces_are_fixed(t, upright(len(t), seed), gyr, READS) or size < 0.3
