"""The noise of a device at rest: closed forms, and slow sums where there are none."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.windows.quiet import QuietNoise, estimate_quiet_noise, running_means


def test_white_noise_falls_with_the_root_of_the_duration_and_spreads_so() -> None:
    """For white noise s_k = a_k."""
    allan = np.sqrt(0.5 ** np.arange(8))[:, None] * [1.0, 3.0]
    np.testing.assert_allclose(QuietNoise(allan, 300).spread, allan)


def test_the_spread_sums_what_changes_at_all_longer_durations() -> None:
    allan = np.array([[2.0], [1.0], [3.0]])
    half = [2.0, 0.5, 4.5]
    expected = [sum(half[k:]) + half[-1] for k in range(3)]
    np.testing.assert_allclose(QuietNoise(allan, 30).spread[:, 0], np.sqrt(expected))


@pytest.mark.parametrize(("m", "levels"), [(1, 1), (3, 1), (4, 2), (9, 3), (600, 8)])
def test_running_means_are_means_of_neighbours(m: int, levels: int) -> None:
    values = np.random.default_rng(m).normal(size=(m, 2))
    found = running_means(values)
    assert len(found) == levels
    for k, u in enumerate(found):
        width = 2**k
        slow = [values[i : i + width].mean(axis=0) for i in range(m - width + 1)]
        np.testing.assert_allclose(u, slow, atol=1e-12)
    assert len(running_means(values, 2)) == min(levels, 2)


def slow(means: Array) -> Array:
    """(1) and (2) of one channel (m,), the longer levels by least squares."""
    m = len(means)
    levels = [k for k in range(8) if 2**k <= max(1, m // 2)]
    known = []
    for k in levels:
        width = 2**k
        u = np.convolve(means, np.ones(width) / width, "valid")
        if k and len(u) < 16 * width:
            break
        steps = np.abs(u[width:] - u[:-width])
        known.append(1.4826 * np.median(steps) / np.sqrt(2))
    variance = np.square(known)
    tau = 2.0 ** np.arange(len(levels))
    use = slice(min(2, max(0, len(known) - 2)), len(known))
    v, t = variance[use], tau[use]
    flat = 0.0
    if len(v) > 1:
        relative = np.maximum(v / v.max(), 1e-6)
        # the error of a variance is as large as itself, over the root of its number
        flat = np.polyfit(1 / t, v, 1, w=1 / (np.sqrt(t) * relative))[1]
    flat = min(max(flat, 0.0), v[-1])
    white = (v[-1] - flat) * t[-1]
    # flicker with a knee of 0.05 Hz is an Allan variance of 2 ln 2 k times the density
    flat = max(flat, 2 * np.log(2) * 0.05 * 0.1 * white)
    beyond = np.sqrt(white / tau[len(known) :] + flat)
    return np.concatenate([known, beyond])


@pytest.mark.parametrize("m", [2, 5, 18, 33, 40, 60, 130, 300, 3000])
@pytest.mark.parametrize("kind", ["white", "walk", "falling"])
def test_each_level_is_the_slow_one(m: int, kind: str) -> None:
    rng = np.random.default_rng(m)
    x = rng.normal(size=(m, 3)) * [1e-3, 1.0, 30.0]
    if kind == "walk":
        x = np.cumsum(x, axis=0)
    if kind == "falling":
        x = np.diff(x, axis=0, append=0.0)
    found = estimate_quiet_noise(x)
    assert found.cells == m
    for channel in range(3):
        np.testing.assert_allclose(
            found.allan[:, channel], slow(x[:, channel]), rtol=1e-6
        )


def test_the_noise_of_white_cells_is_their_deviation() -> None:
    found = estimate_quiet_noise(
        0.3 * np.random.default_rng(0).standard_normal((6000, 40))
    )
    expected = 0.3 / np.sqrt(2.0 ** np.arange(8))
    np.testing.assert_allclose(found.allan.mean(axis=1), expected, rtol=0.05)


def test_a_step_and_a_push_leave_the_noise_as_it_is() -> None:
    x = np.random.default_rng(1).standard_normal((600, 1))
    disturbed = x.copy()
    disturbed[200:] += 20
    disturbed[400:420] += 50
    np.testing.assert_allclose(
        estimate_quiet_noise(disturbed).allan[:4],
        estimate_quiet_noise(x).allan[:4],
        rtol=0.1,
    )


def test_what_never_varies_has_no_noise() -> None:
    assert not estimate_quiet_noise(np.full((100, 2), 3.0)).allan.any()


def test_windows_before_are_pooled_by_their_cells() -> None:
    x = np.random.default_rng(2).standard_normal((40, 1))
    own = estimate_quiet_noise(x).allan
    before = QuietNoise(0.9 * own, 120)
    found = estimate_quiet_noise(x, before)
    assert found.cells == 160
    expected = np.sqrt((40 * own**2 + 120 * (0.9 * own) ** 2) / 160)
    np.testing.assert_allclose(found.allan, expected)


def test_the_noise_may_double_from_one_window_to_the_next_and_no_more() -> None:
    x = np.random.default_rng(3).standard_normal((40, 2))
    own = estimate_quiet_noise(x).allan
    known = np.column_stack([own[:, 0] / 10, 0 * own[:, 1]])
    found = estimate_quiet_noise(x, QuietNoise(known, 40)).allan
    bounded = np.sqrt(((2 * known[:, 0]) ** 2 + known[:, 0] ** 2) / 2)
    np.testing.assert_allclose(found[:, 0], bounded)
    # of what never varied before nothing is known
    np.testing.assert_allclose(found[:, 1], own[:, 1] / np.sqrt(2))


@pytest.mark.parametrize("levels", [2, 8])
def test_levels_that_only_one_of_the_windows_has_are_taken_over(levels: int) -> None:
    x = np.random.default_rng(4).standard_normal((40, 1))
    own = estimate_quiet_noise(x).allan
    assert len(own) == 5
    before = QuietNoise(np.full((levels, 1), 0.5), 40)
    found = estimate_quiet_noise(x, before).allan
    assert len(found) == max(5, levels)
    expected = own[2:] if levels == 2 else np.full((3, 1), 0.5)
    np.testing.assert_allclose(found[min(5, levels) :], expected)
