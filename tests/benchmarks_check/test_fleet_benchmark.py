"""Lots and sessions that a benchmark draws are what it says of them."""

from __future__ import annotations

import numpy as np

from benchmarks.fleet import drawn, units
from fieldcal.fleet.reduced import ReducedSession, SharedColumn
from fieldcal.history import sessions


def test_units_are_odd_and_shifted_as_often_as_said() -> None:
    some = units(np.random.default_rng(1), 400, odd=0.01, shift=3.0)
    odd = [one for one in some if one.serial.startswith("odd")]
    assert len(odd) == 4
    value, sigma = sessions.parameter_values(some, "acc_bias.x")
    assert np.median(value[200:]) - np.median(value[:200]) > 0.04
    assert (sigma == 0.01).all()
    assert {one.levels["lot"] for one in some[200:]} == {"B"}
    assert [one.taken_at or "" for one in some] == sorted(
        one.taken_at or "" for one in some
    )


def test_sessions_are_drawn_with_the_information_of_recorded_ones() -> None:
    rng = np.random.default_rng(2)
    columns = tuple(SharedColumn("cubic", "", "", n, "1", 1.0, 0.01) for n in "xy")
    matrix = np.array([[4.0, 1.0], [1.0, 3.0]])
    there = np.tile([2.0, -1.0], (800, 1))
    known = [ReducedSession(columns, matrix, np.zeros(2))]
    pulls = np.array(
        [
            ReducedSession.from_bytes(one.reduced or b"").rhs
            for one in drawn(rng, known, there, 5)
        ]
    )
    np.testing.assert_allclose(pulls.mean(axis=0), matrix @ there[0], atol=0.3)
    np.testing.assert_allclose(np.cov(pulls.T), matrix, atol=0.6)
