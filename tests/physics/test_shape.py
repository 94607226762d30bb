"""Instants that are tried: between rows, and where something was left out."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import instants


def rows(starts: Array, ends: Array) -> Experience:
    """Rows of one window."""
    n = len(starts)
    return Experience.at_rest(
        np.zeros(n), np.zeros(n), 9.8, t=(starts + ends) / 2, lasts=ends - starts,
        position=np.zeros(n, dtype=np.intp),
    )  # fmt: skip


def test_an_instant_where_something_was_left_out_is_tried() -> None:
    lengths = np.geomspace(1.0, 60.0, 120)
    edges = np.concatenate([[0.0], np.cumsum(lengths)])
    starts, ends = edges[:-1].copy(), edges[1:].copy()
    calm = instants(rows(starts, ends))
    off = np.abs(edges[20:60, None] - calm).min(axis=1)
    at = 20 + int(np.argmax(off))
    ends[at - 1] -= 0.7
    starts[at] += 0.5
    found = instants(rows(starts, ends))
    knocked = edges[at] - 0.1
    assert np.abs(found - knocked).min() < 1e-6
    assert np.abs(calm - knocked).min() > 1.0
    assert len(found) <= len(calm) + 1


def test_an_instant_lies_between_rows_that_are_unlike() -> None:
    starts = np.arange(40.0)
    ends = starts + 1
    ends[-1] = 400.0
    at = instants(rows(starts, ends))
    assert np.abs(at[:, None] - ends).min(axis=1).max() < 1e-9
