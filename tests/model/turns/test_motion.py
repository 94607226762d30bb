"""Bounds of a motion between two windows, of rates that are written out."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.reduce import reduce_to_rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.model.turns.motion import motion_bounds
from fieldcal.model.turns.turn_tracker import TurnTracker
from fieldcal.session.description_file import parse_description

RATE, NOISE = 100.0, 1e-4
GAP = (1000, 4000)
"""Samples between the windows, 10 s and 40 s."""

MARGIN = 60
"""0.6 s."""


def recorded(
    rate: Array, bias: Array | None = None, gap: tuple[int, int] = GAP
) -> tuple[RowSource, Rows]:
    """Two windows at rest about a gap; the rate (n,) is about z."""
    rng, n = np.random.default_rng(1), len(rate)
    gyr = NOISE * rng.standard_normal((n, 3))
    gyr[:, 2] += rate
    gyr += 0.0 if bias is None else bias
    acc = 1e-3 * rng.standard_normal((n, 3)) + [0.0, -9.8, 0.0]
    block = Block.of(np.arange(n) / RATE, acc, gyr)
    places = [
        {"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": a, "end_s": b}
        for a, b in ((0.0, gap[0] / RATE), (gap[1] / RATE, n / RATE))
    ]
    usable = np.ones((n, 6), dtype=bool)
    about = parse_description({"format": 1, "position": places})
    source = RowSource(block, about, usable, np.zeros(2), Thermometer.of(block))
    return source, reduce_to_rows(source)


def turning(first: int, last: int, size: float = 0.5, n: int = 5000) -> Array:
    rate = np.zeros(n)
    rate[first:last] = size
    return rate


@pytest.mark.parametrize("size", [0.5, -0.5, 0.02])
@pytest.mark.parametrize("bias", [0.0, 0.3])
def test_the_motion_is_found_with_some_time_around_it(size: float, bias: float) -> None:
    source, rows = recorded(turning(2000, 2500, size), np.full(3, bias))
    found = motion_bounds(source, rows, (0, 1), *GAP)
    assert found is not None
    start, end = found
    assert 2000 - MARGIN - 12 <= start <= 2000 - MARGIN + 1
    assert 2500 + MARGIN - 1 <= end <= 2500 + MARGIN + 12


def test_beside_a_window_without_gyroscopes_all_of_the_way_is_motion() -> None:
    """A device that sends on change has none where it rests; nothing warns of it."""
    source, rows = recorded(turning(2000, 2500))
    rows.y[rows.x.position == 1, 4] = np.nan
    with warnings.catch_warnings(action="error"):
        assert motion_bounds(source, rows, (0, 1), *GAP) == GAP


def test_it_ends_where_the_windows_do() -> None:
    source, rows = recorded(turning(1020, 3990))
    assert motion_bounds(source, rows, (0, 1), *GAP) == GAP


@pytest.mark.parametrize(("before", "after"), [(1, 0), (0, 1), (1, 1)])
def test_what_goes_slowly_before_and_after_belongs_to_it(
    before: int, after: int
) -> None:
    """2e-3 rad/s for a second do not show at once; the angle does."""
    rate = turning(2000, 2500)
    rate[1800:1900] = 2e-3 * before
    rate[2600:2700] = 2e-3 * after
    source, rows = recorded(rate)
    found = motion_bounds(source, rows, (0, 1), *GAP)
    assert found is not None
    start, end = found
    first, last = (1800 if before else 2000), (2700 if after else 2500)
    assert first - MARGIN - 12 <= start <= first - MARGIN + 40
    assert last + MARGIN - 40 <= end <= last + MARGIN + 12


def test_where_nothing_stands_out_the_gap_is_taken() -> None:
    source, rows = recorded(turning(2000, 2500, 1e-3))
    assert motion_bounds(source, rows, (0, 1), *GAP) == GAP
    source, rows = recorded(turning(2000, 2500, 1e-3, 8000), gap=(1000, 7100))
    long = motion_bounds(source, rows, (0, 1), 1000, 6900)
    assert long == (1000, 6900), "59 s"
    assert motion_bounds(source, rows, (0, 1), 1000, 7100) is None, (
        "61 s are not followed"
    )


@pytest.mark.parametrize(("end", "followed"), [(7200, True), (7450, False)])
def test_a_motion_of_more_than_a_minute_is_not_followed(
    end: int, followed: bool
) -> None:
    gap = 1000, 8000
    source, rows = recorded(turning(1500, end, n=9000), gap=gap)
    assert (motion_bounds(source, rows, (0, 1), *gap) is not None) == followed


def test_without_all_samples_no_motion_is_followed() -> None:
    source, rows = recorded(turning(2000, 2500))
    source.usable[3000, 1] = False
    assert motion_bounds(source, rows, (0, 1), *GAP) is None
    source.usable[3000, 1], source.usable[4500, 1] = True, False
    assert motion_bounds(source, rows, (0, 1), *GAP) is not None
    assert motion_bounds(source, rows, (0, 1), 2000, 2039) is None, "too few"
    for lost, found in ((2, True), (3, False)):
        t = source.block.t.copy()
        t[2200:] += lost / RATE
        source.block.t[:] = t
        assert (motion_bounds(source, rows, (0, 1), *GAP) is not None) == found
        source.block.t[:] = np.arange(len(t)) / RATE


def test_single_samples_that_may_not_be_used_are_as_if_they_were_missing() -> None:
    """A turn is followed across them, and not across a second without any."""
    source, rows = recorded(turning(2000, 2500))
    lost = source.usable.copy()
    lost[1700:2700:40, 4] = False
    legs = [TurnTracker(s, rows, np.zeros((1, len(rows.x)))).legs
            for s in (source, replace(source, usable=lost))]  # fmt: skip
    (pair, first, last), (other, begins, ends) = legs[0][0], legs[1][0]
    assert pair == other
    whole = replace(source, usable=lost).complete_samples.block
    assert len(whole) == len(source.block) - 25
    t = source.block.t
    assert whole.t[begins] == pytest.approx(t[first], abs=0.05)
    assert whole.t[ends] == pytest.approx(t[last], abs=0.05)
    lost[2200:2300] = False
    broken = replace(source, usable=lost)
    assert not TurnTracker(broken, rows, np.zeros((1, len(rows.x)))).legs
    nothing = replace(source, usable=np.zeros_like(lost))
    assert source.complete_samples is source and nothing.complete_samples is nothing


@pytest.mark.parametrize("size", [0.5, 5e-3, 2e-3])
@pytest.mark.parametrize("unit", [[0.25] * 3, [-8.0] * 3, [4.0, 0.5, 2.0]])
def test_the_unit_of_gyroscopes_moves_no_bounds(size: float, unit: list[float]) -> None:
    source, rows = recorded(turning(2000, 2500, size))
    expected = motion_bounds(source, rows, (0, 1), *GAP)
    block = replace(source.block, gyr=source.block.gyr * unit)
    nominal = {**source.about.nominal, "gyr_scale": np.array(unit)}
    other = replace(source, block=block, about=replace(source.about, nominal=nominal))
    assert motion_bounds(other, reduce_to_rows(other), (0, 1), *GAP) == expected
    assert (expected == GAP) == (size < 6e-3), "twice 3e-3 rad/s"


def test_a_motion_stands_out_of_the_noise_of_its_own_axis() -> None:
    """Of an axis that is a hundred times as loud no limit of another one says so."""
    source, _ = recorded(np.zeros(5000))
    gyr = source.block.gyr.copy()
    gyr[:, 2] *= 400.0
    gyr[2000:2011, 2] += 0.16
    loud = replace(source, block=replace(source.block, gyr=gyr))
    rows = reduce_to_rows(loud)
    limit = 8 * rows.noise[5] / np.sqrt(10)
    mean = np.convolve(gyr[slice(*GAP), 2], np.ones(10) / 10, "valid")
    assert limit < np.abs(mean - rows.y[-1, 5]).max() < 2 * limit
    assert motion_bounds(loud, rows, (0, 1), *GAP) == GAP
