"""A direction of gravity in the place of accelerations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.session.direction_alone import (
    direction_alone_text,
    refuse_direction_alone,
)

FACES = np.array([[0.0, 0.0, 9.8], [0.0, 9.8, 0.0], [6.0, -7.0, 3.2]])
WINDOWS = [(0.0, 9.99), (10.0, 19.99), (20.0, 29.99)]


def forces(noise: float) -> Array:
    """Three positions of 10 s at 100 Hz."""
    rng = np.random.default_rng(1)
    return np.repeat(FACES, 1000, axis=0) + noise * rng.standard_normal((3000, 3))


def recorded(acc: Array) -> Block:
    return Block.of(np.arange(len(acc)) / 100, acc, np.zeros_like(acc))


def said_of(
    block: Block, windows: Sequence[tuple[float, float] | None] = WINDOWS
) -> str:
    """Why the accelerations are refused; empty if they are not."""
    try:
        refuse_direction_alone(block, windows)
    except InputError as error:
        return str(error)
    return ""


def direction(acc: Array) -> Array:
    out: Array = 9.80665 * acc / np.linalg.norm(acc, axis=1, keepdims=True)
    return out


@pytest.mark.parametrize("step", [0.0, 1e-4])
@pytest.mark.parametrize("noise", [1e-3, 1e-2])
def test_a_direction_is_refused_and_a_force_is_not(noise: float, step: float) -> None:
    acc = forces(noise)
    for values, refused in ((direction(acc), True), (acc, False)):
        block = recorded(np.round(values / step) * step if step else values)
        if not refused:
            assert said_of(block) == ""
            continue
        with pytest.raises(InputError, match=r"magnitude 9\.806\d* m/s² .* raw"):
            refuse_direction_alone(block, WINDOWS)


def test_single_precision_does_not_hide_it() -> None:
    acc = direction(forces(1e-3)).astype(np.float32).astype(float)
    with pytest.raises(InputError, match="direction of gravity"):
        refuse_direction_alone(recorded(acc), WINDOWS)


def test_a_simulation_without_errors_is_a_force() -> None:
    """At rest, on a base that sways, and with steps larger than the noise."""
    still = 9.8 * FACES / np.linalg.norm(FACES, axis=1, keepdims=True)
    sway = 0.01 * np.sin(np.pi * np.arange(3000) / 100)
    swaying = 9.8 * np.column_stack([np.sin(sway), np.cos(sway), np.zeros(3000)])
    coarse = np.round(forces(1e-3) / 0.04) * 0.04
    for acc in (np.repeat(still, 1000, axis=0), swaying, coarse):
        assert said_of(recorded(acc)) == ""


def test_without_accelerations_nothing_is_said() -> None:
    for acc in (np.full((3000, 3), np.nan), np.zeros((3000, 3))):
        assert said_of(recorded(acc)) == ""
    assert direction_alone_text([], 0.0) == ""
    assert said_of(recorded(direction(forces(1e-3))), [None, (50.0, 60.0)]) == ""


def test_the_noise_that_is_told_is_that_across_the_direction() -> None:
    for noise, told in ((2e-3, "0.002"), (7e-3, "0.007")):
        with pytest.raises(InputError, match=f"scatter by {told} m/s² across"):
            refuse_direction_alone(recorded(direction(forces(noise))), WINDOWS)
