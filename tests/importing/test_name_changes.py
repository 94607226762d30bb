"""Names of rows that change while the time of one device goes on, and of others."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.samples import Array
from fieldcal.importing.times.name_changes import NameChanges

T = np.arange(600) / 50
NAMES = np.repeat(["a", "b", "c"], 200)


def in_pieces(t: Array, cuts: list[int], skips: bool) -> NameChanges:
    """Changes of names that are handed over in pieces, those of one name in short."""
    changes, edges = NameChanges(), [0, *sorted({*cuts}), len(t)]
    for a, b in zip(edges, edges[1:], strict=False):
        alike = b > a and a > 0 and len({*NAMES[a:b].tolist()}) == 1
        if skips and alike:
            changes.skip(str(NAMES[a]), float(t[a]), float(t[b - 1]), b - a)
        else:
            changes.feed(NAMES[a:b], t[a:b])
    return changes


@given(st.lists(st.integers(1, 599)), st.booleans())
def test_time_that_goes_on_is_that_of_one_device(cuts: list[int], skips: bool) -> None:
    assert in_pieces(T, cuts, skips).go_on


@given(st.lists(st.integers(1, 599)), st.booleans(), st.sampled_from([-4.0, 0.5, 20.0]))
def test_time_that_leaps_is_that_of_others(
    cuts: list[int], skips: bool, leap: float
) -> None:
    t = T + np.where(np.arange(600) >= 400, leap, 0.0)
    assert not in_pieces(t, cuts, skips).go_on


def test_rows_in_turn_are_those_of_others() -> None:
    changes = NameChanges()
    changes.feed(np.tile(["a", "b"], 300), T)
    assert not changes.go_on


def test_without_a_change_nothing_goes_on() -> None:
    changes = NameChanges()
    changes.feed(np.full(600, "a"), T)
    assert not changes.go_on
