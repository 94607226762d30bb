"""Between which positions samples are missing."""

from __future__ import annotations

import numpy as np
from still_samples import about, place, samples

from fieldcal.core.samples import Block
from fieldcal.model.rows.interruptions import interruptions

KNOWN = about(place(1.0, 3.0), place(5.0, 7.0), place(8.0, 9.5))


def without(*gaps: tuple[float, float]) -> Block:
    block = samples(10.0)
    kept = np.ones(len(block), bool)
    for start, end in gaps:
        kept &= (block.t < start) | (block.t > end)
    return Block.of(block.t[kept], block.acc[kept], block.gyr[kept])


def test_a_gap_between_positions_lies_between_the_end_and_the_start_of_them() -> None:
    assert interruptions(samples(10.0), KNOWN) == []
    ((start, end),) = interruptions(without((3.4, 4.2)), KNOWN)
    assert 2.9 < start < 3.4 and 4.2 < end <= 5.0
    assert len(interruptions(without((3.4, 4.2), (7.1, 7.8)), KNOWN)) == 2


def test_what_is_lost_for_a_moment_or_within_a_position_is_no_interruption() -> None:
    assert interruptions(without((3.4, 3.8)), KNOWN) == []
    assert interruptions(without((5.2, 6.4)), KNOWN) == []
    assert interruptions(without((0.0, 0.9), (9.6, 10.0)), KNOWN) == []
    assert interruptions(without((3.4, 4.2)), about()) == []


def test_order_of_the_positions_and_those_without_samples_change_nothing() -> None:
    other = about(
        place(8.0, 9.5), place(100.0, 101.0), place(5.0, 7.0), place(1.0, 3.0)
    )
    block = without((3.4, 4.2))
    assert interruptions(block, other) == interruptions(block, KNOWN)
