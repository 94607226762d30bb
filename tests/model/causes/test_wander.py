"""How the biases wander inside windows: measured, and what cosines leave of it."""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import SD, ladder, rows_of

from fieldcal.model.causes import smooth
from fieldcal.model.causes.wander import Wander

X = ladder(rows=30)
UNIT = np.ones(6)


@pytest.mark.parametrize("speed", [1e-3, 5e-3])
def test_a_walk_is_measured_beside_what_settles(speed: float) -> None:
    """Seen at its own size, whatever the first rows after a turn do."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        y = np.hstack([X.f, X.w]) + SD * rng.standard_normal((len(X), 6))
        steps = np.sqrt(np.diff(X.t, prepend=0.0)) * rng.standard_normal(len(X))
        y[:, 1] += (2 / 3) ** 0.5 * speed * np.cumsum(steps)  # (1): means, not instants
        y[:, 2] += 0.1 * np.exp(-X.since_turn / 3.0)
        found = Wander.of(rows_of(X, y), UNIT)
        assert found.speed[1] == pytest.approx(speed, rel=0.35)
        assert found.modes[1] > smooth.WAVES
        assert (found.modes[[0, 2, 3, 4, 5]] == smooth.WAVES).all()
        left = found.left(np.ones(1), 0) + found.left(np.ones(1), 2)
        assert left[0] < 0.01 * SD[0] ** 2


def test_what_cosines_leave_is_the_rest_of_their_series() -> None:
    """(2) and (3), against so many cosines that no more is left."""
    length, count = 300.0, 60
    one = Wander(np.full(6, 2e-3), np.full(6, count), length)
    t, piece = np.array([10.0, 10.5, 13.0, 40.0]), 0.5
    k = np.arange(count + 1, 200_000)
    fine = t[:, None] + piece * (np.arange(50) + 0.5) / 50 - piece / 2
    size = one.speed[0] ** 2 * length / (np.pi * k) ** 2
    covariance = np.zeros((4, 4))
    for i in range(4):
        for j in range(4):
            lag = np.abs(np.subtract.outer(fine[i], fine[j])).ravel()
            each, counts = np.unique(np.round(lag, 9), return_counts=True)
            values = [size @ np.cos(np.pi * k * v / length) for v in each]
            covariance[i, j] = counts @ values / counts.sum()
    some = one.apart(t, np.full(4, piece))[0]
    assert np.abs(some - covariance).max() < 0.02 * covariance[0, 0]
    assert some[0, 0] == pytest.approx(one.left(np.array([piece]), 0)[0])
