"""What a filter makes of a turn, in rows that are drawn; in turns: `test_turn`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from small_sessions import G, dictionary, ladder, nominal

from fieldcal.core.samples import Array
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.filtered_turns import FILTERED, filtered_turns
from fieldcal.model.priors import FILTERED_S
from fieldcal.physics.experience import Experience


def columns_in(x: Experience) -> Array:
    """Columns of both triads, by the variance, then by the skew and so on."""
    table = dictionary(ladder())
    group = filtered_turns(table)
    sizes = [FILTERED_S**2] * 2 + [2 * FILTERED_S**3] * 2 + [3 * FILTERED_S**4] * 2
    assert group.part == FILTERED
    np.testing.assert_allclose(group.prior_sigma(1.0), sizes, rtol=1e-12)
    start, basis = table.bases[-1]
    assert isinstance(basis, General)
    assert list(group.columns) == list(range(start, start + 6))
    return basis.evaluate(RowView.of(x, np.zeros((1, len(x))), nominal()))


def on_the_way(slopes: Array) -> Experience:
    """A turn with some angular accelerations at instants 20 ms apart, (n, 3)."""
    unknown, t = np.full(len(slopes), np.nan), 0.02 * np.arange(len(slopes))
    f = G * np.column_stack([np.sin(t), np.cos(t), 0 * t])
    x = Experience.at_rest(unknown, unknown, G, t=t, f=f, position=np.full(len(t), -1))
    return replace(x, w_dot=slopes)


def test_a_force_that_turns_is_bent_towards_its_mean() -> None:
    """Half of f'' = -f at 1 rad/s, on the accelerometers alone."""
    x = on_the_way(np.ones((60, 3)))
    found = columns_in(x)
    np.testing.assert_allclose(found[3:-3, :3, 0], -x.f[3:-3] / 2, atol=2e-3)
    assert not found[:, 3:, ::2].any() and not found[:, :3, 1::2].any()
    slope = np.gradient(x.f, x.t, axis=0)
    np.testing.assert_allclose(found[4:-4, :3, 2], slope[4:-4] / 6, atol=2e-3)
    # the fourth derivative is the force again
    np.testing.assert_allclose(found[5:-5, :3, 4], x.f[5:-5] / 24, atol=2e-3)


def test_noise_of_what_rests_at_both_ends_closes() -> None:
    """Were the device not turned, w'' would sum up to nothing, however noisy."""
    x = on_the_way(np.random.default_rng(1).normal(size=(60, 3)))
    for found in np.moveaxis(columns_in(x)[:, 3:, 1::2], 2, 0):
        whole = 0.02 * (found.sum(axis=0) - (found[0] + found[-1]) / 2)
        np.testing.assert_allclose(whole, 0.0, atol=1e-9)
        assert np.abs(found).max() > 10.0


def test_at_rest_there_is_nothing() -> None:
    x = ladder(rows=2)
    assert not columns_in(replace(x, w_dot=np.ones((len(x), 3)))).any()
