"""Noise of two recordings, whose samples are rounded to steps that are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fieldcal.against.noise_levels import noise_differences
from fieldcal.against.side import sample_noise
from fieldcal.core.samples import Block
from fieldcal.session.description_file import parse_description

PLACES = [{"start_s": 10.0 * k, "end_s": 10.0 * k + 9.9} for k in range(4)]
ABOUT = parse_description({"format": 1, "position": PLACES})


def side(sigma: float, step: float, seed: int) -> Any:
    """Of an output that lies anywhere between two steps in each of four positions."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 40.0, 0.02)
    six = rng.uniform(-5, 5, (4, 6))[np.minimum(t // 10, 3).astype(int)]
    six = six + sigma * rng.standard_normal((len(t), 6))
    if step:
        six = step * np.round(six / step)
    block = Block.of(t, six[:, :3], six[:, 3:])
    noise, unsure = sample_noise(block, ABOUT)
    about = SimpleNamespace(position_numbers=(1, 2, 3, 4))
    prepared = SimpleNamespace(source=SimpleNamespace(about=about))
    return SimpleNamespace(
        noise=noise, noise_uncertainty=unsure, steps=np.full(6, step), block=block,
        explanation=SimpleNamespace(prepared=prepared),
    )  # fmt: skip


@pytest.mark.parametrize("step", [0.01, 0.5, 1.0, 2.0, 4.0, 8.0])
def test_steps_of_one_are_no_other_noise(step: float) -> None:
    """Up to eight times the noise; whichever of the two has them."""
    for seed in range(15):
        plain, rounded = side(1.0, 0.0, seed), side(1.0, step, seed + 100)
        assert not list(noise_differences(plain, rounded)), seed
        assert not list(noise_differences(rounded, plain)), seed


@pytest.mark.parametrize("step", [0.0, 0.01, 1.0])
def test_another_noise_is_named_beside_steps_that_do_not_hide_it(step: float) -> None:
    for seed in range(5):
        found = list(noise_differences(side(2.0, step, seed), side(1.0, 0.0, seed + 9)))
        assert [(d.id, d.direction) for d in found] == [("noise", "resized")] * 2
        for c in "xyz":
            told = found[0].parameters[f"a{c}"]
            assert told.real is not None and told.simulator is not None
            assert float(told.real.value) > 1.7 * float(told.simulator.value)


def test_a_simulator_without_noise_leaves_it_out() -> None:
    silent = side(0.0, 0.0, 3)
    found = list(noise_differences(side(1.0, 0.0, 1), silent))
    assert [d.direction for d in found] == ["left_out"] * 2
