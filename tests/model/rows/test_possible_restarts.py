"""Gaps between positions in which the device may have restarted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from still_samples import about, place, samples

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.possible_restarts import possible_restarts

KNOWN = about(place(1.0, 3.0), place(5.0, 7.0), place(8.0, 9.5))


def without(*gaps: tuple[float, float]) -> Block:
    block = samples(10.0)
    kept = np.ones(len(block), bool)
    for start, end in gaps:
        kept &= (block.t < start) | (block.t > end)
    return Block.of(block.t[kept], block.acc[kept], block.gyr[kept])


def test_a_gap_between_positions_lies_between_the_end_and_the_start_of_them() -> None:
    assert possible_restarts(samples(10.0), KNOWN) == []
    ((start, end),) = possible_restarts(without((3.4, 4.2)), KNOWN)
    assert 2.9 < start < 3.4 and 4.2 < end <= 5.0
    assert len(possible_restarts(without((3.4, 4.2), (7.1, 7.8)), KNOWN)) == 2


def test_what_is_lost_for_a_moment_or_within_a_position_is_no_interruption() -> None:
    assert possible_restarts(without((3.4, 3.8)), KNOWN) == []
    assert possible_restarts(without((5.2, 6.4)), KNOWN) == []
    assert possible_restarts(without((0.0, 0.9), (9.6, 10.0)), KNOWN) == []
    assert possible_restarts(without((3.4, 4.2)), about()) == []


def test_order_of_the_positions_and_those_without_samples_change_nothing() -> None:
    other = about(
        place(8.0, 9.5), place(100.0, 101.0), place(5.0, 7.0), place(1.0, 3.0)
    )
    block = without((3.4, 4.2))
    assert possible_restarts(block, other) == possible_restarts(block, KNOWN)


GAP = (3.4, 4.2)


def counted(seq: Array) -> list[tuple[float, float]]:
    """Possible restarts where the samples, of which some are lost, have a counter."""
    kept = np.isin(samples(10.0).t, without(GAP).t)
    return possible_restarts(replace(without(GAP), seq=seq[kept]), KNOWN)


@pytest.mark.parametrize("span", [2.0**16, 2.0**32, np.inf])
@pytest.mark.parametrize("first", [0.0, 65_300.0, 65_350.0, 7e5])
def test_a_counter_that_went_on_shows_that_the_device_did(
    span: float, first: float
) -> None:
    seq = first + np.arange(len(samples(10.0)), dtype=float)
    assert counted(np.fmod(seq, span)) == []


def test_a_counter_that_began_anew_or_counts_what_came_shows_nothing() -> None:
    block = samples(10.0)
    seq = 1000.0 + np.arange(len(block))
    assert counted(np.where(block.t > 3.8, seq - seq[200], seq)) != []
    assert possible_restarts(
        replace(without(GAP), seq=np.arange(len(without(GAP)), dtype=float)), KNOWN
    )
    assert counted(np.where(block.t == block.t[9], np.nan, seq)) != []


def test_a_counter_of_few_numbers_is_no_witness() -> None:
    assert counted(np.arange(len(samples(10.0))) % 256.0) != []


def test_times_made_of_the_counter_do_not_bear_witness_to_it() -> None:
    """A restart at number 40 000 looks as if 25 536 samples had been lost."""
    block = without(GAP)
    later = np.arange(len(block)) >= np.searchsorted(block.t, 3.8)
    host = block.t + 100.0
    seq = np.where(later, 0, 40_000) + np.arange(len(block)) * 1.0
    t = block.t + np.where(later, 25_536 / 50.0, 0.0)
    moved = about(place(1.0, 3.0), place(5.0 + 25_536 / 50, 7.0 + 25_536 / 50))
    whole = replace(block, t=t, seq=seq, t_host=host)
    assert possible_restarts(whole, moved) != []


def test_the_devices_clock_shows_it_gap_by_gap() -> None:
    block = without(GAP, (7.1, 7.8))
    known = replace(KNOWN, gaps_without_restart=((3.39, 4.21),))
    ((start, _),) = possible_restarts(block, known)
    assert start > 6.9
