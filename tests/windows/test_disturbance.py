"""Departures from rest, against their equations summed cell by cell."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.windows.disturbance import LeastSpread, pushes, repeats, shakes, steps
from fieldcal.windows.quiet import estimate_quiet_noise

M = 64


def at_least(*always: float, sampled: float = 0.0, number: float = 1.0) -> LeastSpread:
    """Bounds of as many channels as there are numbers."""
    bound = np.array(always)
    ones = np.ones(len(bound))
    return LeastSpread(bound, sampled * ones, number * ones)


NONE, ONE = at_least(0.0, 0.0), at_least(0.0)


def cells(seed: int = 0) -> Array:
    return np.random.default_rng(seed).standard_normal((M, 2)) * [1.0, 0.1]


def mean_of(values: Array, first: int, number: int) -> Array:
    """Mean of some cells, one after the other."""
    return np.asarray(sum(values[first : first + number]) / number)


def test_a_push_is_a_mean_over_its_spread() -> None:
    y, noise = cells(), estimate_quiet_noise(cells())
    tests = pushes(y, noise, NONE)
    assert [t.cells for t in tests] == [1, 2, 4, 8, 16, 32]
    for k, test in enumerate(tests):
        assert test.kind == "push" and len(test.z) == M - test.cells + 1
        for i in (0, 5, M - test.cells):
            u = mean_of(y, i, test.cells)
            np.testing.assert_allclose(test.size[i], u, atol=1e-12)
            np.testing.assert_allclose(test.z[i], abs(u) / noise.spread[k])
        np.testing.assert_array_equal(test.noise, noise.spread[k])


def test_a_step_is_a_difference_of_neighbouring_means() -> None:
    y, noise = cells(), estimate_quiet_noise(cells())
    tests = steps(y, noise, NONE)
    assert [t.cells for t in tests] == [1, 2, 4, 8, 16, 32]
    for k, test in enumerate(tests):
        long = test.cells
        assert test.kind == "step" and len(test.z) == M - 2 * long + 1
        for i in (0, len(test.z) // 2, len(test.z) - 1):
            change = mean_of(y, i + long, long) - mean_of(y, i, long)
            np.testing.assert_allclose(test.size[i], change, atol=1e-12)
            usual = np.sqrt(2) * noise.allan[k]
            np.testing.assert_allclose(test.noise, usual)
            np.testing.assert_allclose(test.z[i], abs(change) / usual)


def test_a_shake_is_an_excess_of_the_noise_from_sample_to_sample() -> None:
    q = np.random.default_rng(1).chisquare(9, (M, 2)) / 9 * [1.0, 0.01]
    number = np.full((M, 2), 9.0) * [1, 7]
    number[10], number[11] = [3.0, 21.0], [18.0, 126.0]
    tests = shakes(q, number, NONE)
    assert [t.cells for t in tests] == [1, 2, 4, 8]
    root = q ** (1 / 3) - np.median(q ** (1 / 3), axis=0)
    root[10] *= np.sqrt(1 / 3)
    spread = 1.3 * 1.4826 * np.median(abs(root), axis=0)
    for test in tests:
        long = test.cells
        assert test.kind == "shake" and len(test.z) == M - long + 1
        np.testing.assert_allclose(test.noise, np.sqrt(np.median(q, axis=0)))
        for i in (0, 9, M - long):
            size = np.sqrt(mean_of(q, i, long))
            np.testing.assert_allclose(test.size[i], size)
            z = mean_of(root, i, long) * np.sqrt(long) / spread
            np.testing.assert_allclose(test.z[i], z)


def test_the_cube_root_of_a_variance_of_few_is_close_to_normal() -> None:
    q = np.random.default_rng(2).chisquare(9, (4000, 1)) / 9
    first, *_, last = shakes(q, np.full((4000, 1), 9.0), ONE)
    # 1.3 wider than normal, for sensors that are low-passed
    assert first.z.std() == pytest.approx(1 / 1.3, abs=0.03)
    assert last.z.std() == pytest.approx(1 / 1.3, abs=0.06)


def test_cells_without_a_change_do_not_shake() -> None:
    q = np.random.default_rng(3).chisquare(9, (M, 1)) / 9
    number = np.full((M, 1), 9.0)
    q[5], number[5] = 100.0, 0.0
    assert shakes(q, number, ONE)[0].z[5] == 0
    # one change is all that a cell of a slow device has
    each = shakes(q, np.ones((M, 1)), ONE)
    full = shakes(q, np.full((M, 1), 9.0), ONE)
    np.testing.assert_array_equal(each[0].z[20:], full[0].z[20:])
    nothing = shakes(np.zeros((M, 1)), np.zeros((M, 1)), ONE)
    assert not any(test.z.any() or test.size.any() for test in nothing)


def test_nothing_is_measured_finer_than_the_least_spread() -> None:
    y, noise = cells(), estimate_quiet_noise(cells())
    least = at_least(0.0, 100.0)
    for make in (pushes, steps):
        for plain, bound in zip(
            make(y, noise, NONE), make(y, noise, least), strict=True
        ):
            np.testing.assert_array_equal(bound.z[:, 0], plain.z[:, 0])
            np.testing.assert_allclose(bound.z[:, 1], abs(plain.size[:, 1]) / 100)
    q = np.random.default_rng(4).chisquare(9, (M, 2)) / 9
    plain, bound = (shakes(q, np.full((M, 2), 9.0), x)[0] for x in (NONE, least))
    np.testing.assert_array_equal(bound.z[:, 0], plain.z[:, 0])
    root = np.cbrt(q[:, 1])
    expected = (root - np.median(root)) / np.cbrt(100.0**2)
    np.testing.assert_allclose(bound.z[:, 1], expected)


def test_noise_that_steps_hide_counts_less_the_more_samples_a_mean_has() -> None:
    y, noise = cells(), estimate_quiet_noise(cells())
    hidden = at_least(0.0, 0.0, sampled=300.0, number=9.0)
    for make, more in ((pushes, 1.0), (steps, np.sqrt(2.0))):
        for test in make(y, noise, hidden):
            spread = more * 300 / np.sqrt(9 * test.cells)
            np.testing.assert_allclose(test.z, abs(test.size) / spread)
    q = np.random.default_rng(5).chisquare(9, (M, 2)) / 9
    (first, *_) = shakes(q, np.full((M, 2), 9.0), hidden)
    root = np.cbrt(q)
    expected = (root - np.median(root, axis=0)) / (np.cbrt(300.0**2) / 3)
    np.testing.assert_allclose(first.z, expected)


def test_what_never_varies_is_no_disturbance() -> None:
    y = np.zeros((M, 2))
    y[20, 0] = 5.0
    for make in (pushes, steps):
        assert not any(
            test.z.any() for test in make(y, estimate_quiet_noise(0 * y), NONE)
        )


def test_a_run_of_one_value_is_found_with_its_place() -> None:
    q, number = np.ones((M, 3)), np.full((M, 3), 3.0)
    q[20:30, 1] = 0.0  # ten cells of three values
    q[40:49, 1] = 0.0  # nine cells
    q[50:64, 2] = 0.0
    assert repeats(q, number, range(3)) == [(1, 20, 30), (2, 50, 64)]
    assert repeats(q, number, [0, 2]) == [(2, 50, 64)]


def test_few_values_and_cells_without_any_do_not_make_a_run() -> None:
    q, number = np.zeros((M, 1)), np.zeros((M, 1))
    assert repeats(q, number, [0]) == []
    number[:19] = 1.0
    assert repeats(q, number, [0]) == []
    number[:20] = 1.0
    assert repeats(q, number, [0]) == [(0, 0, 20)]
