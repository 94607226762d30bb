"""How the biases wander inside windows: measured, and what cosines leave of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import SD, ladder, rows_of

from fieldcal.model import priors
from fieldcal.model.causes import smooth
from fieldcal.model.causes.wander import Wander
from fieldcal.model.turns.turn import only

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


def test_outputs_in_counts_wander_by_counts() -> None:
    """Of outputs ten times as large everything is ten times as large."""
    rng = np.random.default_rng(3)
    y = np.hstack([X.f, X.w]) + SD * rng.standard_normal((len(X), 6))
    steps = np.sqrt(np.diff(X.t, prepend=0.0)) * rng.standard_normal(len(X))
    y[:, 1] += 3e-3 * np.cumsum(steps)
    plain = rows_of(X, y)
    unit = np.array([10.0, 10.0, 0.2, 5.0, 1.0, 1.0])
    counted = replace(plain, y=plain.y * unit, sd=plain.sd * unit)
    one, many = Wander.of(plain, UNIT), Wander.of(counted, unit)
    np.testing.assert_allclose(many.speed, one.speed * unit, rtol=1e-9)
    np.testing.assert_array_equal(many.modes, one.modes)
    assert many.length == one.length == pytest.approx(np.ptp(X.t))


def test_cosines_beyond_the_noise_are_as_many_as_it_is_above_it() -> None:
    """(4), with the information of all rows of the channel."""
    rng = np.random.default_rng(3)
    y = np.hstack([X.f, X.w]) + SD * rng.standard_normal((len(X), 6))
    steps = np.sqrt(np.diff(X.t, prepend=0.0)) * rng.standard_normal(len(X))
    y[:, 1] += 2e-3 * np.cumsum(steps)
    found = Wander.of(rows_of(X, y), UNIT)
    length = np.ptp(X.t)
    modes = found.speed[1] * np.sqrt(2 * length * len(X) / 2) / SD[1] / np.pi
    assert found.modes[1] == int(min(modes, priors.MOST_WAVES)) > smooth.WAVES
    none = Wander.none()
    assert not none.speed.any() and set(none.modes) == {smooth.WAVES}
    assert not none.apart(np.arange(3.0), np.ones(3)).any()


def test_of_few_differences_nothing_is_told() -> None:
    for places in (3, 4):  # two of the later half of five rows each
        kept = (np.arange(len(X)) % 30 < 5) & (X.position < places)
        some = only(X, np.flatnonzero(kept).tolist())
        y = np.random.default_rng(1).standard_normal((len(some), 6))
        assert Wander.of(rows_of(some, y), UNIT).speed.any() == (places == 4)


def test_what_goes_evenly_does_not_wander() -> None:
    rng = np.random.default_rng(3)
    y = np.hstack([X.f, X.w]) + SD * rng.standard_normal((len(X), 6))
    y[:, 0] += 1e-3 * X.t
    level = Wander.of(rows_of(X, y), UNIT).speed[0]
    assert level < 2e-5


def test_what_cosines_leave_is_the_rest_of_their_series() -> None:
    """(2) and (3), against so many cosines that no more is left."""
    length, count = 300.0, 60
    one = Wander(np.full(6, 2e-3), np.full(6, count), length)
    t, piece = np.array([10.0, 10.5, 13.0, 40.0]), 0.5
    k = np.arange(count + 1, 40_000)
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
