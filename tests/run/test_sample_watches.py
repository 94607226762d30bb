"""What is wrong with samples is said once a position, and again after the next turn."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.drivers.driver import Driver
from fieldcal.run.sample_watches import SampleWatches
from fieldcal.session.description_file import parse_description
from fieldcal.windows import Average


def test_a_direction_of_gravity_is_told_after_two_seconds() -> None:
    device = cast(Driver, SimpleNamespace(notes={}))
    rng = np.random.default_rng(2)
    acc = [0.0, 6.0, -7.8] + 5e-3 * rng.standard_normal((400, 3))
    t = np.arange(400) / 100
    for sent, told in (
        (acc, False),
        (np.round(acc, 3), False),
        (9.80665 * acc / np.linalg.norm(acc, axis=1, keepdims=True), True),
    ):
        watches = SampleWatches(device, parse_description({}))
        block = Block.of(t, sent, 1e-3 * rng.standard_normal((400, 3)))
        for first in range(0, 400, 50):
            assert first >= 200 or not [*watches.new_notices(0)]
            watches.add(block[first : first + 50])
        said = [*watches.new_notices(0)]
        assert bool(said) == told
        assert all("direction of gravity" in s and "end this (q)" in s for s in said)


def test_a_notice_is_said_once_a_position_until_a_window_is_taken() -> None:
    device = cast(Driver, SimpleNamespace(notes={}))
    watches = SampleWatches(device, parse_description({}))
    noise = 2e-3 * np.random.default_rng(1).standard_normal((100, 3))
    assert [*watches.new_notices(0)] == []
    watches.add_rest(noise - noise.mean(axis=0))
    (said,) = watches.new_notices(0)
    assert "zero" in said
    assert [*watches.new_notices(0)] == []
    assert [*watches.new_notices(1)] == [said]
    zero = np.array([0.0, -9.81, 0.0, 0.0, 0.0, 0.0])
    spread = np.diag([1e-6] * 3 + [2.5e-9] * 3)
    watches.add_window(Average(zero, spread, 20.0, 3000, 0.0, 30.0))
    assert [*watches.new_notices(1)] == [said]
