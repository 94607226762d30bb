"""Rounding on the way, against rates that are known, rounded and summed sample by
sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array, Block
from fieldcal.model.turns import rounded
from fieldcal.model.turns.rounded import StandingOutputs, find_standing_outputs

STEP, RATE, N, EACH = 0.02, 100.0, 400, 2
SCALE = np.array([1.0, 1.02, 0.98])
EDGE = np.arange(0, N, EACH)


class Drawn(NamedTuple):
    """One turn.

    Attributes
    ----------
    gyr : (n, 3) rounded rates
    attitude : (m + 1, 3, 3) at the edges, from device axes at the start
    off : (3,) rad/s, what rounding makes of the means at rest
    closure : (3,) rad, what it makes of the turn

    """

    gyr: Array
    attitude: Array
    off: Array
    closure: Array


def drawn(rng: np.random.Generator) -> Drawn:
    """About x by 90 to 150 degrees, about y to and fro by few steps, not about z."""
    t, bias = np.arange(N) / RATE, rng.uniform(-0.5, 0.5, 3) * STEP
    w = np.zeros((N, 3))
    w[:, 0] = rng.uniform(1.6, 2.6) * np.sin(np.pi * t / t[-1]) ** 2
    w[:, 1] = 3 * STEP * np.sin(2 * np.pi * t / t[-1] + rng.uniform(0, 6))
    w *= (t > 0.5)[:, None] & (t < t[-1] - 0.5)[:, None]
    ahead = [Rotation.identity()]
    for step in w[:-1] / RATE:
        ahead.append(Rotation.from_rotvec(-step) * ahead[-1])
    plain = w * SCALE + bias
    gyr = STEP * np.round(plain / STEP)
    back = np.array([r.inv().as_matrix() for r in ahead])
    closure = np.einsum("nij,nj->i", back, (gyr - plain) / SCALE) / RATE
    off = STEP * np.round(bias / STEP) - bias
    attitude = np.array([r.as_matrix() for r in ahead])[EDGE]
    return Drawn(gyr, attitude, off, closure)


def stands(variance: float = STEP**2 / 12) -> StandingOutputs:
    return StandingOutputs(np.zeros(3), np.full(3, STEP), np.full(3, variance))


@pytest.mark.thorough
def test_what_rounding_makes_of_a_turn_is_as_large_as_is_said() -> None:
    rng, pulls, alone = np.random.default_rng(5), [], []
    for _ in range(120):
        one = drawn(rng)
        share = stands().share(one.gyr, EDGE)
        shared = np.einsum("mci,mc,c->i", one.attitude, share, one.off / SCALE)
        t = np.arange(N) / RATE
        covariance = stands().closure_covariance(t, one.gyr, SCALE, EDGE, one.attitude)
        left = one.closure - shared * EACH / RATE
        pulls.append(left @ np.linalg.solve(covariance, left) / 3)
        alone.append(one.closure @ np.linalg.solve(covariance, one.closure) / 3)
    assert 0.7 < np.mean(pulls) < 1.5
    assert np.mean(alone) > 20.0, "what is as in the windows is the most of it"


def test_an_axis_that_is_not_turned_stands_and_one_that_is_does_not() -> None:
    one = drawn(np.random.default_rng(1))
    share = stands().share(one.gyr, EDGE)
    assert share.shape == (len(EDGE), 3) and (share >= 0).all() and (share <= 1).all()
    np.testing.assert_array_equal(share[:, 2], 1.0)
    middle = (EDGE > 100) & (EDGE < 300)
    assert not share[middle, 0].any()
    assert 0.1 < share[middle, 1].mean() < 0.9


def block(noise: float) -> tuple[Block, NDArray[np.intp]]:
    rng = np.random.default_rng(3)
    rates = 0.3 * STEP * np.array([1.0, -1.0, 0.5]) + noise * rng.normal(size=(1200, 3))
    rates[400:500] += rng.uniform(0, 1, (100, 3))
    acc = np.tile([0.0, 0.0, 9.8], (1200, 1)) + 0.01 * rng.normal(size=(1200, 3))
    rounded = STEP * np.round(rates / STEP)
    windows = np.array([[0, 390], [510, 800], [810, 1190]], dtype=np.intp)
    return Block.of(np.arange(1200) / RATE, acc, rounded), windows


def test_a_gyroscope_stands_where_its_noise_reaches_across_no_step() -> None:
    found = find_standing_outputs(*block(0.02 * STEP), np.full(3, STEP / 12**0.5))
    assert found is not None
    np.testing.assert_array_equal(found.value, 0.0)
    np.testing.assert_allclose(found.step, STEP)
    np.testing.assert_allclose(found.variance, STEP**2 / 12)


@pytest.mark.parametrize("alike", [(0.0, 0.0, 0.0), (0.0, 1e-3, 0.0)])
def test_what_windows_do_not_share_is_not_met_again(
    alike: tuple[float, float, float],
) -> None:
    found = find_standing_outputs(*block(0.02 * STEP), np.array(alike))
    if not any(alike):
        assert found is None
        return
    assert found is not None
    assert (found.step > 0).tolist() == [False, True, False]
    gyr = np.zeros((40, 3))
    assert found.share(gyr, np.arange(0, 40, 2)).any(axis=0).tolist() == [
        False, True, False,
    ]  # fmt: skip


def test_a_dead_band_hides_on_the_way_what_it_hides_at_rest() -> None:
    """The outputs of a turn that begins and ends slowly, against those of no band."""
    rng, band = np.random.default_rng(8), 0.03
    t, n, bias = np.arange(2000) / RATE, 2000, band * np.array([0.5, -0.7, 0.3])
    w = np.zeros((n, 3))
    w[800:1200, 0] = 2 * np.sin(np.linspace(0, np.pi, 400)) ** 2
    plain = w * SCALE + bias + 0.3 * band * rng.standard_normal((n, 3))
    gyr = np.where(np.abs(plain) < band, 0.0, plain)
    windows = np.array([[0, 700], [1300, 2000]], dtype=np.intp)
    acc = rng.normal(9.8, 0.01, (n, 3))
    found = find_standing_outputs(Block.of(t, acc, gyr), windows, np.full(3, band))
    assert found is not None and not found.variance.any()
    on, edge = slice(700, 1300), np.arange(0, 600, EACH)
    share = found.share(gyr[on], edge)
    off = (gyr - plain)[windows[0, 0] : windows[0, 1]].mean(axis=0)
    hidden = (gyr - plain)[on].mean(axis=0)
    np.testing.assert_allclose(share.mean(axis=0) * off, hidden, atol=0.05 * band)
    assert (np.abs(hidden) > 0.1 * band).all() and share[150:200, 0].max() < 0.1
    same = np.tile(np.eye(3), (len(edge), 1, 1))
    assert not found.closure_covariance(t[on], gyr[on], SCALE, edge, same).any()


def test_runs_beside_the_value_of_windows_add_up_one_by_one() -> None:
    """(1) sample by sample: three steps up, one of them turned back from."""
    scale, dt = np.array([2.0, -0.5, 1.0]), 0.01
    lengths = [5, 4, 2, 8, 3, 6]
    values = [0, 1, 2, 3, 2, 0]
    gyr = np.zeros((28, 3))
    gyr[:, 0] = STEP * np.repeat(values, lengths)
    gyr[:, 1] = -2.0 * STEP  # not that of windows, and never another one
    gyr[:, 2] = STEP * np.arange(28)  # of no grid: noise hides its steps
    edge = np.arange(0, 29, 4)[:-1]
    rng = np.random.default_rng(2)
    attitude = Rotation.random(len(edge), random_state=rng).as_matrix()
    variance = np.array([3e-5, 5e-5, 7e-5])
    one = StandingOutputs(np.zeros(3), np.array([STEP, STEP, 0.0]), variance)
    found = one.closure_covariance(dt * np.arange(28), gyr, scale, edge, attitude)
    expected = np.zeros((3, 3))
    starts = np.cumsum([0, *lengths])
    n = [float(length) for length in lengths]
    share = [0.0, (n[1] / n[2] - n[1] / n[0]) ** 2 / 12,
             (n[2] / n[3] - n[2] / n[1]) ** 2 / 12, 1.0,
             (n[4] / n[5] - n[4] / n[3]) ** 2 / 12, 0.0]  # fmt: skip
    assert max(share[1:3]) < 1 < n[3]
    for k, part in enumerate(share):
        middle = (starts[k] + starts[k + 1]) // 2
        at = min(int(np.sum(edge < middle)), len(edge) - 1)
        axis = attitude[at].T @ [1.0, 0.0, 0.0]
        size = variance[0] * (n[k] * dt / scale[0]) ** 2 * part
        expected += size * np.outer(axis, axis)
    axis = attitude[int(np.sum(edge < 14))].T @ [0.0, 1.0, 0.0]
    expected += variance[1] * (28 * dt / scale[1]) ** 2 * np.outer(axis, axis)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_run_that_is_crossed_unevenly_counts_once_at_most() -> None:
    value, length = np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 40.0, 2.0, 3.0])
    found = rounded._run_factor(value, length)
    second = (2.0 * (1 / 3.0 - 1 / 40.0)) ** 2 / 12
    np.testing.assert_allclose(found, [1.0, 1.0, second, 1.0])


def test_a_share_is_that_of_the_samples_about_an_edge() -> None:
    """Of as many as lie from edge to edge; at the ends of those that there are."""
    gyr = np.zeros((12, 3))
    gyr[5:9, 0] = gyr[2:3, 1] = STEP
    gyr[:, 2] = 0.98 * STEP
    share = stands().share(gyr, np.array([0, 4, 8, 11]))
    at = np.abs(gyr) < 0.99 * STEP
    for row, middle in zip(share, (0, 4, 8, 11), strict=True):
        some = [k for k in range(middle - 2, middle + 2) if 0 <= k < 12]
        np.testing.assert_allclose(row, at[some].mean(axis=0))
