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


def rows(t: Array, lasts: Array) -> Experience:
    unknown = np.full(len(t), np.nan)
    return Experience.at_rest(unknown, unknown, G, t=t, lasts=lasts)


def block(six: Array = SIX) -> Block:
    return Block.of(T, six[:, :3], six[:, 3:])


def undone(sigma: tuple[float, float] = (0.02, 0.02), six: Array = SIX,
           seconds: tuple[float, float] = (TAU, TAU)) -> UndoneSmoothing:  # fmt: skip
    return UndoneSmoothing(block(six), WINDOW, np.array(seconds), np.array(sigma))


def test_while_turning_it_is_the_slope_of_what_was_smoothed() -> None:
    t = np.linspace(2.1, 3.9, 40)
    (found,) = columns_in(undone(), rows(t, np.zeros(len(t))))
    expected = SLOPE * (1 - np.exp(-(t - 2.0) / TAU))
    assert found.shape == (40, 6, 1)
    np.testing.assert_allclose(found[2:-2, 0, 0], expected[2:-2], atol=0.05)
    np.testing.assert_allclose(found[:, 4, 0], 0.2 * found[:, 0, 0], rtol=1e-9)


def test_in_a_window_it_is_what_still_settles() -> None:
    """Behind the ramp y' decays; its mean over a row, from the closed form."""
    t = np.array([4.8, 5.8, 8.8])
    (found,) = columns_in(undone(), rows(t, np.ones(3)))
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
    x = rows(np.array([6.8, 7.8]), np.ones(2))
    (found,) = columns_in(undone(six=SIX + noise), x)
    assert np.abs(found).max() < 0.02


def test_what_was_calculated_with_a_wrong_constant_is_off_by_it() -> None:
    """(1), with the samples smoothed and undone one by one, 5 % wrong."""
    wrong, y = TAU * 0.95, np.zeros(len(T))
    for k in range(1, len(T)):
        y[k] = y[k - 1] + (RAMP[k] - y[k - 1]) * (1 - np.exp(-STEP / TAU))
    share = np.exp(-STEP / wrong)
    got = np.append(0.0, (y[1:] - share * y[:-1]) / (1 - share))
    t = np.linspace(2.5, 3.5, 11)
    six = np.tile(got[:, None], 6)
    (found,) = columns_in(undone(six=six, seconds=(wrong, wrong)),
                          rows(t, np.full(11, STEP)))  # fmt: skip
    off = np.interp(t, T, RAMP - got)
    np.testing.assert_allclose(found[:, 0, 0] * (TAU - wrong), off, rtol=0.03)
    assert np.abs(off).min() > 0.02


@pytest.mark.parametrize("seconds", [(TAU, 0.0), (0.0, TAU)])
def test_a_sensor_that_was_not_smoothed_has_nothing_left(
    seconds: tuple[float, float],
) -> None:
    x = rows(np.linspace(2.5, 3.5, 5), np.zeros(5))
    (found,) = columns_in(undone(seconds=seconds), x)
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
    x = rows(np.array([3.2, 6.0]), np.array([0.1, 1.0]))
    (whole,), (lacking,) = columns_in(undone(), x), columns_in(undone(six=gone), x)
    np.testing.assert_allclose(lacking, whole, rtol=0.02, atol=1e-9)
