"""When a device came to rest, of recordings whose motion is written out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.rest_onset import rest_instants, window_starts
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.session.description import Description
from fieldcal.session.description_file import parse_description

RATE = 100.0
NOISE = np.repeat([1e-2, 1e-3], 3)
PIECE = 0.2
"""Motion is told to a piece of so many seconds."""


def about(*windows: tuple[float, float] | None) -> Description:
    places: list[dict[str, Any]] = [
        {"alpha_deg": 0.0, "beta_deg": 0.0}
        | ({"start_s": w[0], "end_s": w[1]} if w else {})
        for w in windows
    ]
    return parse_description({"format": 1, "position": places})


KNOWN = about((4.0, 10.0), (20.0, 30.0))


def recorded(moving: Array, size: float, channel: int) -> Block:
    """At rest but for a channel that is off by `size` from and to some instants."""
    t = 1.0 + np.arange(3000) / RATE
    six = NOISE * np.random.default_rng(0).standard_normal((len(t), 6))
    six[:, 1] -= 9.8
    six[(t >= moving[0]) & (t < moving[1]), channel] += size
    return Block.of(t, six[:, :3], six[:, 3:])


@pytest.mark.parametrize(("channel", "size"), [(3, 0.5), (5, -0.5), (4, 4e-3)])
@pytest.mark.parametrize("until", [13.0, 17.6])
def test_the_last_sign_of_motion_is_the_arrival(
    channel: int, size: float, until: float
) -> None:
    found = rest_instants(
        recorded(np.array([11.0, until]), size, channel), KNOWN, NOISE
    )
    assert found[0] == 1.0, "with nothing before it the first rests from the start"
    assert until - 0.02 <= found[1] <= until + PIECE + 0.02


@pytest.mark.parametrize(
    ("channel", "size"),
    [
        (0, 3.0),  # a force beside gyroscopes that rest is no turn
        (3, 1.5e-3),  # within seven deviations of a mean of 0.2 s, and below 2e-3
    ],
)
def test_what_is_no_motion(channel: int, size: float) -> None:
    found = rest_instants(recorded(np.array([11.0, 15.0]), size, channel), KNOWN, NOISE)
    assert found[1] == pytest.approx(10.0)


@pytest.mark.parametrize(("size", "moves"), [(1.5e-2, False), (3e-2, True)])
def test_noisy_gyroscopes_have_to_show_more(size: float, moves: bool) -> None:
    """Seven deviations of a mean of twenty: 7 * 0.0125 / sqrt(20) is 0.0196."""
    noise = np.repeat([1e-2, 1.25e-2], 3)
    found = rest_instants(recorded(np.array([11.0, 15.0]), size, 4), KNOWN, noise)
    assert (found[1] > 14.9) == moves


@pytest.mark.parametrize(("size", "moves"), [(0.04, False), (0.07, True), (-9.0, True)])
def test_without_gyroscopes_the_force_tells(size: float, moves: bool) -> None:
    block = recorded(np.array([11.0, 15.0]), size, 2)
    bare = Block.of(block.t, block.acc)
    found = rest_instants(bare, KNOWN, NOISE)
    assert found[1] == pytest.approx(15.1 if moves else 10.0, abs=0.12)


def test_one_that_moves_until_the_window_begins_has_just_arrived() -> None:
    found = rest_instants(recorded(np.array([11.0, 20.0]), 0.5, 3), KNOWN, NOISE)
    assert found[1] == pytest.approx(20.0, abs=0.02)


def test_of_slow_samples_a_piece_has_two() -> None:
    """Of five a second, counted back from the window: 20 - 17 * 0.4 s."""
    t = 1.0 + np.arange(150) / 5.0
    six = NOISE * np.random.default_rng(0).standard_normal((len(t), 6))
    six[(t >= 11.0) & (t < 13.1), 3] += 0.5
    block = Block.of(t, six[:, :3], six[:, 3:])
    assert rest_instants(block, KNOWN, NOISE)[1] == pytest.approx(13.2)


def test_between_windows_that_touch_there_is_no_turn_to_see() -> None:
    known = about((4.0, 10.0), (10.0, 20.0), (20.05, 25.0))
    block = recorded(np.array([0.0, 0.0]), 0.0, 3)
    np.testing.assert_allclose(rest_instants(block, known, NOISE), [1.0, 10.0, 20.05])


def test_a_window_begins_where_it_is_said_to_or_with_the_arrival() -> None:
    block = recorded(np.array([11.0, 15.0]), 0.5, 3)
    known = about((4.0, 10.0), None)
    usable = np.ones((len(block), 6), dtype=bool)
    arrived = np.array([2.5, 16.0])
    source = RowSource(block, known, usable, arrived, Thermometer.of(block))
    np.testing.assert_allclose(window_starts(source), [4.0, 16.0])
    whole = RowSource(block, about(), usable, arrived[:1], Thermometer.of(block))
    np.testing.assert_allclose(window_starts(whole), [1.0])
    assert rest_instants(block, known, NOISE)[1] == 1.0, "nobody knows without a window"
