"""Turns of samples that a host stamped when they arrived: some nearly at one time."""

from __future__ import annotations

import numpy as np
import pytest
import strapdown

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.fit import build_fit
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.model.turns.attitude import accelerations
from fieldcal.model.turns.rotation import small_turns
from fieldcal.session.description_file import parse_description

DEVICE = {"noise": {"acc": [0.01] * 3, "gyr": [1e-3] * 3}}


def batches(count: int, size: int, rate: float) -> Array:
    """Stamps of samples of which `size` arrive together, 0.1 ms apart."""
    k = np.arange(count)
    out: Array = (k // size) * size / rate + 1e-4 * (k % size)
    return out


@pytest.mark.parametrize("size", [1, 2, 3])
def test_noise_adds_up_to_little_more_than_by_the_trapezoid_rule(size: int) -> None:
    """Of a device at rest that is integrated for 6 s, two hundred times."""
    t, edge = batches(301, size, 50.0), np.arange(301)
    rng = np.random.default_rng(5)
    found, plain = [], []
    for _ in range(200):
        w = rng.standard_normal((301, 3))
        found.append(small_turns(t, w, edge).sum(axis=0))
        plain.append(np.trapezoid(w, t, axis=0))
    assert np.std(found) < 1.25 * np.std(plain)


def test_an_acceleration_is_the_slope_whatever_the_times_within_a_batch() -> None:
    t = batches(240, 3, 50.0)
    rate = 0.7 * (np.arange(240) / 50.0)[:, None] * [1.0, -2.0, 0.0]
    found = accelerations(t, rate)[8:-8]
    np.testing.assert_allclose(found[:, 0], 0.7, rtol=0.35)
    np.testing.assert_allclose(found.mean(axis=0), [0.7, -1.4, 0.0], rtol=0.05)


def test_a_turn_by_arrivals_does_not_contradict_its_positions() -> None:
    """A quarter of a period late on average, each sample by its own delay."""
    table = strapdown.outputs(DEVICE)
    rng = np.random.default_rng(2)
    late = rng.exponential(0.25 / strapdown.RATE_HZ, len(table))
    t = np.maximum.accumulate(table[:, 0] + late) + 1e-7 * np.arange(len(table))
    about = parse_description(
        {"format": 1, "site": {"gravity": strapdown.GRAVITY},
         "position": strapdown.schedule()}
    )  # fmt: skip
    prepared = prepare_recording(Block.of(t, table[:, 1:4], table[:, 4:]), about)
    fit = build_fit(prepared)
    assert fit.turns is not None
    tracker = fit.turns.tracker
    turns = list(tracker.turns(fit.nominal))
    assert not tracker.contradicted_turns
    assert len(turns) == len(strapdown.ANGLES) - 1
    # 5 ms at the 0.6 rad/s of half a turn in 5 s, at both ends
    assert np.abs([turn.closure for turn in turns]).max() < 0.015
