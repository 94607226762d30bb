"""What is left of a smoothing undone with a wrong time constant, by the closed form.

A ramp of slope r that begins at t = 0 is smoothed to y' = r (1 - exp(-t / tau)).
"""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import G, dictionary, ladder, nominal

from fieldcal.core.samples import Array, Block
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.smoothing_left import SMOOTHING, UndoneSmoothing
from fieldcal.physics.experience import Experience

STEP, TAU, SLOPE = 0.01, 0.5, 3.0
T = STEP * np.arange(1000)
RAMP = SLOPE * np.clip(T - 2.0, 0.0, 2.0)
SIX = np.outer(RAMP, [1.0, -1.0, 0.5, 0.1, 0.2, -0.1])
WINDOW = np.array([[430, 1000]])  # the ramp ends at 4 s


def columns_in(left: UndoneSmoothing, x: Experience) -> list[Array]:
    """Columns of the group of what is left, if there is one."""
    table = dictionary(ladder())
    out = []
    for group in left.groups(table):
        assert group.part == SMOOTHING and group.fixed_size == 1.0
        _, basis = table.bases[-1]
        assert isinstance(basis, General)
        out.append(basis.evaluate(RowView.of(x, np.zeros((1, len(x))), nominal())))
    return out


def rows(t: Array) -> Experience:
    """Rows of a second in a window."""
    unknown = np.full(len(t), np.nan)
    return Experience.at_rest(unknown, unknown, G, t=t, lasts=np.ones(len(t)),
                              position=np.zeros(len(t), dtype=int))  # fmt: skip


def edges(t: Array) -> Experience:
    """Edges of a turn in which the inputs are those of the ramp."""
    unknown, f = np.full(len(t), np.nan), [np.interp(t, T, x) for x in SIX.T]
    return Experience.at_rest(unknown, unknown, G, t=t, f=np.stack(f[:3], axis=1),
                              w=np.stack(f[3:], axis=1), lasts=np.zeros(len(t)),
                              position=np.full(len(t), -1))  # fmt: skip


def block(six: Array = SIX) -> Block:
    return Block.of(T, six[:, :3], six[:, 3:])


def undone(sigma: tuple[float, float] = (0.02, 0.02), six: Array = SIX,
           seconds: tuple[float, float] = (TAU, TAU)) -> UndoneSmoothing:  # fmt: skip
    return UndoneSmoothing(block(six), WINDOW, np.array(seconds), np.array(sigma))


def test_while_turning_it_is_the_slope_of_what_was_smoothed() -> None:
    t = np.linspace(2.0, 4.2, 45)
    (found,) = columns_in(undone(), edges(t))
    expected = SLOPE * (1 - np.exp(-(np.minimum(t, 4.0) - 2.0) / TAU))
    expected *= np.exp(-np.maximum(t - 4.0, 0.0) / TAU)
    assert found.shape == (45, 6, 1)
    np.testing.assert_allclose(found[:, 0, 0], expected, atol=1e-9)
    np.testing.assert_allclose(found[:, 4, 0], 0.2 * found[:, 0, 0], atol=1e-9)


def test_a_turn_begins_with_what_the_last_one_left() -> None:
    t = np.linspace(4.4, 6.0, 33)
    (found,) = columns_in(undone(), edges(t))
    expected = SLOPE * (1 - np.exp(-2.0 / TAU)) * np.exp(-(t - 4.0) / TAU)
    np.testing.assert_allclose(found[:, 0, 0], expected, rtol=0.03)


def test_in_a_window_it_is_what_still_settles() -> None:
    """Behind the ramp y' decays; its mean over a row, from the closed form."""
    t = np.array([4.8, 5.8, 8.8])
    (found,) = columns_in(undone(), rows(t))
    peak = SLOPE * (1 - np.exp(-2.0 / TAU))

    def decay(s: Array) -> Array:
        out: Array = np.exp(-(s - 4.0) / TAU)
        return out

    expected = peak * TAU * (decay(t - 0.5) - decay(t + 0.5))
    np.testing.assert_allclose(found[:, 0, 0], expected, rtol=0.02)


def test_noise_at_rest_makes_no_column() -> None:
    """The noise of y is that of the row: it would be taken for something left."""
    noise = np.random.default_rng(3).normal(0.0, 1.0, (len(T), 6))
    noise[:430] = 0.0
    (found,) = columns_in(undone(six=SIX + noise), rows(np.array([6.8, 7.8])))
    assert np.abs(found).max() < 0.02
    moving = edges(np.linspace(2.1, 3.9, 10))
    (loud,), (calm,) = (
        columns_in(undone(six=SIX + noise), moving),
        columns_in(undone(), moving),
    )
    np.testing.assert_allclose(loud, calm, atol=1e-9)


def test_what_was_calculated_with_a_wrong_constant_is_off_by_it() -> None:
    """(1), with the samples smoothed and undone one by one, 5 % wrong."""
    wrong, y = TAU * 0.95, np.zeros(len(T))
    for k in range(1, len(T)):
        y[k] = y[k - 1] + (RAMP[k] - y[k - 1]) * (1 - np.exp(-STEP / TAU))
    share = np.exp(-STEP / wrong)
    got = np.append(0.0, (y[1:] - share * y[:-1]) / (1 - share))
    t = np.linspace(2.0, 4.0, 41)
    (found,) = columns_in(undone(seconds=(wrong, wrong)), edges(t))
    off = np.interp(t, T, got - RAMP)
    np.testing.assert_allclose(found[1:, 0, 0] * (wrong - TAU), off[1:], atol=2e-3)
    assert np.abs(off[20:]).min() > 0.06


@pytest.mark.parametrize("seconds", [(TAU, 0.0), (0.0, TAU)])
def test_a_sensor_that_was_not_smoothed_has_nothing_left(
    seconds: tuple[float, float],
) -> None:
    (found,) = columns_in(undone(seconds=seconds), edges(np.linspace(2.5, 3.5, 5)))
    without = slice(3, 6) if seconds[0] else slice(0, 3)
    assert not found[:, without].any() and found.any()


def test_two_constants_are_wrong_each_by_itself() -> None:
    table = dictionary(ladder())
    (group,) = undone((0.02, 0.03), seconds=(TAU, 2 * TAU)).groups(table)
    np.testing.assert_allclose(group.prior_sigma(1.0), [0.02, 0.03])
    (group,) = undone().groups(table)
    np.testing.assert_allclose(group.prior_sigma(1.0), [0.02])
    assert not list(undone(seconds=(0.0, 0.0)).groups(table))


def test_a_missing_sample_keeps_the_last_value() -> None:
    gone = SIX.copy()
    gone[300] = np.nan
    x = rows(np.array([4.9, 6.0]))
    (whole,), (lacking,) = columns_in(undone(), x), columns_in(undone(six=gone), x)
    np.testing.assert_allclose(lacking, whole, rtol=0.02, atol=1e-9)
