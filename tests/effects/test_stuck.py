"""Runs of one value in outputs of coarse steps: when a channel is stuck."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.effects.stuck import Stuck
from fieldcal.physics.experience import Experience
from fieldcal.physics.recording import CheckedSamples, Grids

RATE, STEP = 5.0, 0.1
REST, TURN = 300, 60
"""Samples of a rest and of a turn; a window leaves out 5 at either end of its rest."""


def slow(stands: int) -> CheckedSamples:
    """Two rests with a turn between, outputs of coarse steps and hardly any noise.

    While the device is turned ax goes on after so many of the turn's samples.
    """
    n = 2 * REST + TURN
    course = np.clip((np.arange(n) - REST) / TURN, 0, 1)
    angle = np.pi * (course - np.sin(2 * np.pi * course) / (2 * np.pi))
    later = np.where(np.arange(n) < REST + stands, 0.0, angle)
    acc = 9.8 * np.column_stack([np.cos(later), np.sin(angle), np.cos(2 * angle)])
    gyr = np.gradient(angle)[:, None] * RATE * [0.0, 0.0, 1.0]
    six = np.round(np.hstack([acc, gyr]) / STEP) * STEP
    windows = np.array([[5, REST - 5], [REST + TURN + 5, n - 5]])
    still = np.full(6, STEP / np.sqrt(12))
    nowhere: Array = np.full(2, np.nan)
    return CheckedSamples(
        Block.of(np.arange(n) / RATE, six[:, :3], six[:, 3:]), windows,
        Experience.at_rest(nowhere, nowhere, 9.8), np.ones(6), np.zeros(6), still,
        still, np.full(6, STEP), Grids(np.zeros(1, np.intp), np.full((1, 6), STEP)),
        np.full(2, np.nan), RATE,
    )  # fmt: skip


@pytest.mark.parametrize(("stands", "stuck"), [(0, []), (16, []), (50, ["ax"])])
def test_a_turn_that_begins_slowly_is_no_channel_that_stands(
    stands: int, stuck: list[str]
) -> None:
    found = Stuck().find(slow(stands))
    assert [fault.channel for fault in found] == stuck
