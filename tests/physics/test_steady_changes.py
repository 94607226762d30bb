"""Courses of a level that changes for good, against the courses they were made of."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.physics.steady_changes import steady_changes

HZ = 50.0


def noisy(course: Array, seed: int = 1) -> Array:
    """A course on two of six outputs, in white noise of a tenth."""
    six = 0.1 * np.random.default_rng(seed).standard_normal((len(course), 6))
    six[:, [1, 4]] += course[:, None] * [1.0, -0.5]
    return six


def left(near: Array, at: tuple[int, int]) -> float:
    """Least rms that a course leaves; infinite where none can be fitted."""
    rms = (float((near - c).std()) for c in steady_changes(near, at, HZ))
    return min(rms, default=np.inf)


def test_a_jump_is_explained_wherever_it_is() -> None:
    for row in (120, 300, 520):
        near = noisy(np.where(np.arange(650) < row, 0.0, 2.0))
        assert left(near, (row, row + 40)) == pytest.approx(0.1, rel=0.05)


def test_a_jump_near_an_end_is_no_jump() -> None:
    """Too little on one side tells its level: only what fades is tried."""
    near = noisy(np.where(np.arange(650) < 640, 0.0, 2.0))
    assert len(steady_changes(near, (640, 645), HZ)) == 0
    assert len(steady_changes(near, (100, 140), HZ)) == 5


@pytest.mark.parametrize("tau_s", [1.0, 2.0, 4.5])
def test_what_fades_after_a_turn_is_explained_only_near_it(tau_s: float) -> None:
    near = noisy(4.0 * np.exp(-np.arange(650) / (tau_s * HZ)))
    assert left(near, (20, 70)) == pytest.approx(0.1, rel=0.05)
    assert left(near, (400, 450)) > 0.12


def test_a_push_is_explained_by_none() -> None:
    push = np.zeros(650)
    push[300:350] = 2.0 * np.sin(np.pi * np.arange(50) / 50)
    assert left(noisy(push), (200, 250)) > 0.15


def test_missing_outputs_do_not_spoil_the_others() -> None:
    near = noisy(np.where(np.arange(650) < 300, 0.0, 2.0))
    near[:, 5] = np.nan
    (course, *_) = steady_changes(near, (300, 340), HZ)
    assert np.isfinite(course).all()
    assert np.diff(course[:, 1]).max() == pytest.approx(2.0, abs=0.05)
