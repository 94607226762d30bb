"""The windowed averager on noise of known error and disturbances of known place."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldcal.core.errors import InputError, Moved
from fieldcal.core.samples import CHANNELS, Array, Block, Grain
from fieldcal.windows import Average, StillnessLimits, Window, average
from fieldcal.windows.cells import CellAccumulator
from fieldcal.windows.grain import rounding_variance
from fieldcal.windows.mean_error import error_of_mean
from windows.signals import HOME, UNIT, block_of, flicker, low_passed, markov, white


def rejection(block: Block) -> Moved | None:
    try:
        average(block)
    except Moved as moved:
        return moved
    return None


@pytest.mark.statistical
def test_white_noise_averages_with_the_root_of_the_number() -> None:
    sigmas = [average(block_of(white(np.random.default_rng(s), 6000))).sigma
              for s in range(10)]  # fmt: skip
    ratio = np.median(sigmas / (UNIT / np.sqrt(6000)))
    assert 0.97 < ratio < 1.06


def test_a_line_does_not_pass_for_noise() -> None:
    rng = np.random.default_rng(0)
    t = np.arange(6000)[:, None] / 100
    x = white(rng, 6000)
    swaying = x + np.sin(2 * np.pi * 1.9 * t + rng.uniform(0, 6, 6))
    alone, along = average(block_of(x)), average(block_of(swaying))
    assert (along.sigma < 2 * alone.sigma).all()


def test_channels_that_wander_together_say_so() -> None:
    rng = np.random.default_rng(1)
    mixing = np.eye(6)
    mixing[1, 0] = mixing[4, 0] = 2.0
    found = np.zeros((6, 6))
    for _ in range(10):
        cov = average(block_of(white(rng, 3000) @ mixing.T)).covariance
        sigma = np.sqrt(np.diag(cov))
        found += cov / np.outer(sigma, sigma) / 10
        assert np.linalg.eigvalsh(cov / np.outer(sigma, sigma)).min() > 0
    truth = mixing @ mixing.T
    size = np.sqrt(np.diag(truth))
    np.testing.assert_allclose(found, truth / np.outer(size, size), atol=0.1)


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("seeds", "most"), [(8, 0), pytest.param(30, 1, marks=pytest.mark.thorough)]
)
def test_noise_alone_is_not_rejected(seeds: int, most: int) -> None:
    """Of 32 windows none, and of 120 no more than one."""
    rejected = 0
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        for source in (white, low_passed(20), markov(0.5), flicker(0.03)):
            rejected += rejection(block_of(source(rng, 3000))) is not None
    assert rejected <= most


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("rate", "seconds"),
    [(50.0, 30.0), pytest.param(100.0, 60.0, marks=pytest.mark.thorough)],
)
def test_five_sigma_for_half_a_second_are_caught(rate: float, seconds: float) -> None:
    n, long = int(rate * seconds), int(rate / 2)
    for seed in range(60):
        rng = np.random.default_rng(seed)
        x = white(rng, n)
        first = (0, n - long, int(rng.integers(n - long)))[seed % 3]
        channel = int(rng.integers(6))
        x[first : first + long, channel] += rng.choice([-5.0, 5.0])
        moved = rejection(block_of(x, rate, start=100.0))
        assert moved is not None and moved.axis == CHANNELS[channel]
        assert abs(moved.at - 100.0 - first / rate) < 0.5
        told = re.search(r"([\d.]+) s into the window on (\w+)", str(moved))
        assert told and abs(float(told[1]) - first / rate) < 0.55


def test_a_lean_is_rejected_and_a_warm_up_is_not() -> None:
    rng = np.random.default_rng(2)
    t = np.arange(6000)[:, None] / 100
    mean_error = 1 / np.sqrt(6000)
    for at in (10.0, 20.0, 40.0, 55.0):
        lean = 60 * mean_error * np.clip((t - at) / 2.0, 0, 1) * np.eye(6)[1]
        moved = rejection(block_of(white(rng, 6000) + lean))
        assert moved and moved.axis == "ay" and abs(moved.at - at) < 5.0
    for size in (5.0, 15.0, 30.0):
        warm = size * mean_error * (1 - np.exp(-t / 100)) / (1 - np.exp(-0.6))
        assert rejection(block_of(white(rng, 6000) + warm)) is None


def test_a_drift_that_no_warm_up_makes_is_rejected() -> None:
    block = block_of(white(np.random.default_rng(3), 6000))
    block.acc[:, 2] += np.linspace(0, 0.3, 6000)
    moved = rejection(block)
    assert moved and moved.axis == "az" and "creeping on az" in str(moved)


def test_what_shakes_to_and_fro_is_rejected() -> None:
    x = white(np.random.default_rng(4), 3000)
    x[1500:1540, 2] += 8 * (-1.0) ** np.arange(40)
    moved = rejection(block_of(x))
    assert moved and moved.axis == "az" and "shaken" in str(moved)
    assert abs(moved.at - 15.0) < 0.3


def test_a_stuck_channel_is_named() -> None:
    block = block_of(white(np.random.default_rng(5), 3000))
    block.acc[1800:2600, 0] = block.acc[1800, 0]
    moved = rejection(block)
    assert moved and moved.axis == "ax" and abs(moved.at - 18.0) < 0.3
    assert "repeats one value for 7.9 s" in str(moved)


def test_a_device_in_motion_throughout_is_no_device_at_rest() -> None:
    t = np.arange(3000) / 100
    block = block_of(white(np.random.default_rng(6), 3000))
    block.acc[:, 0] += 3 * np.sin(2 * np.pi * 0.7 * t)
    moved = rejection(block)
    assert moved and "no device at rest" in str(moved)
    assert average(block, StillnessLimits(acc=10.0)).n == 3000


def same(a: Average, b: Average) -> bool:
    pairs = [(a.mean, b.mean), (a.covariance, b.covariance)]
    return all(np.allclose(x, y, rtol=1e-7, atol=1e-14) for x, y in pairs) and (
        (a.n, a.start, a.end) == (b.n, b.start, b.end)
    )


@pytest.mark.statistical
@settings(max_examples=10)
@given(
    cuts=st.lists(st.integers(0, 1500), max_size=12),
    rate=st.sampled_from([37.0, 100.0, 204.8]),
    lost=st.integers(0, 40),
    seed=st.integers(0, 99),
)
def test_how_samples_are_cut_into_blocks_does_not_matter(
    cuts: list[int], rate: float, lost: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    block = block_of(white(rng, 1500), rate, start=1e5)
    block.acc[rng.integers(0, 1500, lost), 1] = np.nan
    edges = [0, *sorted(cuts), 1500]
    window = Window()
    for first, last in zip(edges, edges[1:], strict=False):
        window.add(block[first:last])
    whole = Window()
    whole.add(block)
    np.testing.assert_allclose(window.sigma, whole.sigma, rtol=1e-7)
    assert (window.disturbance is None) == (whole.disturbance is None)
    assert window.motion_now == pytest.approx(whole.motion_now, rel=1e-6)
    if window.disturbance is None:
        assert same(window.average(), average(block))


def test_a_nan_is_a_missing_value() -> None:
    rng = np.random.default_rng(7)
    block = block_of(white(rng, 3000))
    block.acc[rng.random(3000) < 0.2, 0] = np.nan
    block.gyr[:] = np.nan
    block.temperature[::2] = np.nan
    found = average(block)
    assert found.mean[0] == pytest.approx(np.nanmean(block.acc[:, 0]), rel=1e-12)
    assert np.isnan(found.mean[3:]).all() and np.isnan(found.sigma[3:]).all()
    assert np.isnan(found.covariance[0, 3]) and found.temperature == 25.0
    assert found.sigma[0] == pytest.approx(0.05 / np.sqrt(2400), rel=0.35)


@pytest.mark.statistical
def test_lost_samples_are_no_disturbance() -> None:
    rejected = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        block = block_of(white(rng, 3000))
        kept = np.sort(rng.choice(3000, 2200, replace=False))
        kept = kept[(kept < 700) | (kept > 800)]
        some = Block.of(block.t[kept], block.acc[kept], block.gyr[kept])
        rejected += rejection(some) is not None
    assert rejected == 0


@pytest.mark.statistical
@pytest.mark.parametrize(
    "noise",
    [0.3, *(pytest.param(n, marks=pytest.mark.thorough) for n in (0.1, 0.5, 1.0))],
)
def test_rounding_that_the_noise_does_not_hide_is_in_the_error(noise: float) -> None:
    errors, sigmas = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        truth = rng.uniform(0, 1, 6)
        values = np.round(truth + noise * rng.standard_normal((3000, 6)))
        found = average(Block.of(np.arange(3000) / 100, values[:, :3], values[:, 3:]),
                        StillnessLimits(10, 10, 10, 10))  # fmt: skip
        errors.append(found.mean - truth)
        sigmas.append(found.sigma)
    rms = np.sqrt(np.mean(np.square(errors)) / np.mean(np.square(sigmas)))
    assert 0.35 < rms < 1.15


def test_the_noise_of_one_window_sharpens_the_next() -> None:
    rng = np.random.default_rng(8)
    first = Window()
    first.add(block_of(white(rng, 3000)))
    x = white(rng, 400)
    x[300:350, 1] += 4.0
    alone, after = Window(), Window(noise=first.noise)
    for window in (alone, after):
        window.add(block_of(x))
    assert alone.disturbance is None
    assert after.disturbance and after.disturbance.axis == "ay"


def test_averaging_stops_when_it_is_good_enough_or_useless() -> None:
    rng = np.random.default_rng(9)
    window = Window()
    window.add(block_of(white(rng, 3000)))
    assert window.reason_to_stop() is None and window.reason_to_stop(5e-4) is None
    assert "0.002 m/s² was wanted" in (window.reason_to_stop(2e-3) or "")
    wandering = Window()
    wandering.add(block_of(flicker(5.0)(rng, 6000)))
    assert "the bias wanders" in (wandering.reason_to_stop(1e-9) or "")
    stopped = 0
    for seed in range(40):
        long = Window()
        long.add(block_of(white(np.random.default_rng(seed), 3000)))
        stopped += long.reason_to_stop(1e-9) is not None
    assert stopped <= 1


def test_an_output_that_is_missing_is_no_reason_to_stop() -> None:
    samples = white(np.random.default_rng(9), 3000)
    samples[:, 0] = np.nan
    window = Window()
    window.add(block_of(samples))
    assert window.reason_to_stop(5e-4) is None
    assert "0.002 m/s² was wanted" in (window.reason_to_stop(2e-3) or "")


def test_a_window_shows_how_it_goes() -> None:
    block = block_of(white(np.random.default_rng(10), 3000), start=50.0)
    block.acc[2900:2930, 0] += 0.5
    window = Window()
    assert (window.n, window.elapsed, window.motion_now) == (0, 0.0, 0.0)
    assert np.isnan(window.mean).all() and window.reason_to_stop(1.0) is None
    window.add(block[:20])
    assert np.isnan(window.sigma).all()
    window.add(block[20:2850])
    assert window.disturbance is None and window.motion_now < 1
    assert window.elapsed == pytest.approx(28.49)
    np.testing.assert_allclose(window.mean, block.six[:2850].mean(axis=0), rtol=1e-12)
    window.add(block[2850:2940])
    assert window.motion_now > 1 and window.disturbance
    with pytest.raises(Moved, match="on ax"):
        window.average()


def test_a_window_too_short_has_no_error() -> None:
    with pytest.raises(InputError, match=r"50 samples over 0.49 s .* take 1 s"):
        average(block_of(white(np.random.default_rng(0), 50)))
    with pytest.raises(InputError, match="0 samples"):
        average(block_of(white(np.random.default_rng(0), 0)))


@pytest.mark.statistical
def test_a_device_that_turns_a_little_in_the_hand_is_known_along_gravity() -> None:
    """Across gravity its specific force wanders, along it only its noise is left."""
    pulls, across = [], []
    n = np.array([0.48, -0.8, 0.36])
    aside = np.linalg.svd(n[None, :])[2][1:]
    for seed in range(150):
        rng = np.random.default_rng(seed)
        lean = np.cumsum(rng.standard_normal((500, 2)), axis=0) * 2e-4
        f = 9.81 * (n + lean @ aside)
        f *= 9.81 / np.linalg.norm(f, axis=1)[:, None]
        six = np.hstack([f, np.zeros((500, 3))]) + 0.03 * white(rng, 500)
        window = Window()
        window.add(Block.of(np.arange(500) / 100, six[:, :3], six[:, 3:]))
        mean, covariance = window.mean[:3], window.covariance[:3, :3]
        along = mean / np.linalg.norm(mean)
        pulls.append(np.linalg.norm(mean) - 9.81)
        pulls[-1] /= np.sqrt(along @ covariance @ along)
        across.append(aside[0] @ covariance @ aside[0] / (along @ covariance @ along))
    assert 0.8 < np.std(pulls) < 1.15
    assert np.median(across) > 4


def filled(block: Block, **known: Any) -> Window:
    window = Window(**known)
    window.add(block)
    return window


def parts_of(block: Block) -> tuple[Array, Array, Array]:
    """Covariance by axes, along the force, and the direction of it."""
    cells = CellAccumulator()
    cells.add(block)
    n = np.nan_to_num(cells.table.mean) * [1, 1, 1, 0, 0, 0]
    n /= np.linalg.norm(n)
    steady = cells.table.steady_means
    plain = error_of_mean(steady, cells.table.period).covariance
    along = error_of_mean((steady @ n)[:, None], cells.table.period).covariance
    return plain, along, n


def test_the_mean_along_the_force_has_the_error_of_its_own_spectrum() -> None:
    """And what has nothing in common with it keeps its own, (1)."""
    rng = np.random.default_rng(11)
    x = white(rng, 3000)
    x[:, [0, 2, 3]] += np.cumsum(0.1 * white(rng, 3000, 3), axis=0)
    block = block_of(x)
    block.acc[:, 2] += 3.0
    plain, along, n = parts_of(block)
    found = filled(block).covariance
    assert n @ found @ n == pytest.approx(along[0, 0], rel=1e-6)
    for row in np.linalg.svd((plain @ n)[None])[2][1:]:
        assert row @ found @ row == pytest.approx(row @ plain @ row, rel=1e-6)
    np.testing.assert_allclose(found, found.T)


def test_a_device_without_a_force_has_the_covariance_of_its_axes() -> None:
    block = block_of(white(np.random.default_rng(12), 3000))
    gyr = Block.of(block.t, np.full_like(block.acc, np.nan), block.gyr)
    cells = CellAccumulator()
    cells.add(gyr)
    plain = error_of_mean(cells.table.steady_means, cells.table.period).covariance
    window = filled(gyr)
    np.testing.assert_allclose(window.covariance[3:, 3:], plain[3:, 3:], rtol=1e-6)
    assert np.isnan(window.sigma[:3]).all() and window.disturbance is None
    assert np.isnan(window.mean[:3]).all()


def test_samples_that_are_missing_widen_the_error_by_their_share() -> None:
    block = block_of(white(np.random.default_rng(13), 3000))
    block.gyr[block.t % 0.4 > 0.195, 1] = np.nan
    cells = CellAccumulator()
    cells.add(block)
    share = np.isfinite(cells.table.means[:, 4]).mean()
    assert 0.4 < share < 0.6
    plain, _, _ = parts_of(block)
    found = filled(block).covariance
    assert found[4, 4] == pytest.approx(plain[4, 4] / share**2, rel=1e-6)
    assert found[4, 3] == pytest.approx(plain[4, 3] / share, rel=1e-6)
    assert found[3, 3] == pytest.approx(plain[3, 3], rel=1e-6)


def test_rounding_is_added_to_the_variance_of_each_axis() -> None:
    rng = np.random.default_rng(14)
    step = np.array([0.02, 0.02, 0.02, 0.004, 0.004, 0.004])
    six = np.round((HOME + 0.1 * step * white(rng, 3000)) / step) * step
    block = Block.of(np.arange(3000) / 100, six[:, :3], six[:, 3:])
    cells = CellAccumulator()
    cells.add(block)
    noise = np.nan_to_num(cells.table.noise)
    for grain in (None, Grain(0.02, 0.004), Grain(0.02, 0.004, cut=True)):
        added = rounding_variance(grain or Grain(), cells.table.mean, noise, step)
        window = filled(block, grain=grain)
        plain, _, _ = parts_of(block)
        found = np.diag(window.covariance) - added
        np.testing.assert_allclose(found[3:], np.diag(plain)[3:], atol=1e-12)
        assert (added > 0).all() and (window.sigma > 0.999 * np.sqrt(added)).all()


def test_jumps_that_the_device_announces_are_no_motion() -> None:
    x = white(np.random.default_rng(15), 3000)
    block = block_of(0.001 * x)
    block.acc[1500:1530, 0] += 0.05
    assert filled(block).disturbance
    assert filled(block, grain=Grain(0.1, 0.1)).disturbance is None
    assert average(block, grain=Grain(0.1, 0.1)).n == 3000
    # of what is cut toward zero, a jump across zero is twice as wide
    block.acc[1500:1530, 0] += 0.1
    assert filled(block, grain=Grain(0.1, 0.1)).disturbance
    assert filled(block, grain=Grain(0.1, 0.1, cut=True)).disturbance is None
    block.acc[:, 0] += 5.0
    assert filled(block, grain=Grain(0.1, 0.1, cut=True)).disturbance


def test_what_a_window_taught_is_the_noise_and_its_shape() -> None:
    rng = np.random.default_rng(16)
    first = filled(block_of(flicker(2.0)(rng, 6000)))
    learned = first.noise
    assert learned and learned.quiet and learned.quiet.cells == 600
    assert learned.spectrum_shape_only.quiet is None
    np.testing.assert_array_equal(
        learned.spectrum_shape_only.shape_likelihood, learned.shape_likelihood
    )
    assert (
        learned.shape_likelihood.shape[1] == 7 and learned.shape_likelihood.max() == 0
    )
    # the shape is learnt on: it makes the error of a short window a longer one's
    block = block_of(flicker(2.0)(rng, 1000))
    alone, after = filled(block), filled(block, noise=learned.spectrum_shape_only)
    assert (np.abs(after.sigma / alone.sigma - 1) > 0.02).sum() >= 4
    assert after.motion_now == pytest.approx(alone.motion_now)
    assert after.disturbance is None and alone.disturbance is None
    assert after.noise and after.noise.quiet and after.noise.quiet.cells == 100
    both = filled(block, noise=learned)
    assert both.noise and both.noise.quiet and both.noise.quiet.cells == 700
    np.testing.assert_allclose(both.sigma, after.sigma)
    assert average(block, noise=learned).sigma == pytest.approx(both.sigma)


def test_a_window_too_short_to_teach_hands_on_what_was_known() -> None:
    rng = np.random.default_rng(17)
    learned = filled(block_of(white(rng, 3000))).noise
    short = block_of(white(rng, 150))
    assert filled(short).noise is None
    handed = filled(short, noise=learned).noise
    assert handed and learned and handed.quiet is learned.quiet


def test_limits_are_those_that_are_given() -> None:
    block = block_of(white(np.random.default_rng(18), 3000))
    assert filled(block, limits=StillnessLimits(gyr=1e-4)).disturbance
    with pytest.raises(Moved, match="no device at rest"):
        average(block, StillnessLimits(gyr=1e-4))


def test_it_is_told_why_averaging_can_stop() -> None:
    window = filled(block_of(white(np.random.default_rng(9), 3000)))
    reached = window.sigma[:3].max()
    assert window.reason_to_stop(reached) == (
        f"each accelerometer mean is known to {reached:.2g} m/s², "
        f"{reached:.2g} m/s² was wanted"
    )
    assert (
        window.reason_to_stop(0.999 * reached) is None
        and window.reason_to_stop() is None
    )
    wandering = filled(block_of(flicker(20.0)(np.random.default_rng(9), 3000)))
    told = wandering.reason_to_stop()
    assert told == wandering.reason_to_stop(1e-9)
    largest = wandering.sigma[:3].max()
    found = re.fullmatch(
        r"the bias wanders as much as is averaged out: (\S+) m/s² is reached, and "
        r"60 s would give (\S+) m/s²",
        told or "",
    )
    assert found and found[1] == f"{largest:.2g}"
    assert 0.9 * largest < float(found[2]) < 1.5 * largest


def test_nothing_is_said_of_more_time_before_it_has_settled() -> None:
    x = flicker(20.0)(np.random.default_rng(9), 3000)
    assert filled(block_of(x[:1490])).reason_to_stop() is None
    assert filled(block_of(x[:1501])).reason_to_stop() is not None


def test_more_time_is_worth_it_as_long_as_one_axis_gains() -> None:
    rng = np.random.default_rng(19)
    x = flicker(20.0)(rng, 3000)
    x[:, 0] = 100 * white(rng, 3000, 1)[:, 0]
    window = filled(block_of(x))
    assert window.reason_to_stop() is None
    # unless that axis is known well enough
    sigma = window.sigma
    assert sigma[0] > sigma[1]
    x[:, 0] /= 1000
    window = filled(block_of(x))
    assert window.reason_to_stop() is None
    assert "wanders" in (window.reason_to_stop(1.5 * window.sigma[0]) or "")


def test_an_axis_that_is_not_measured_has_no_say() -> None:
    block = block_of(flicker(20.0)(np.random.default_rng(20), 3000))
    block.acc[:, 2] = np.nan
    window = filled(block)
    assert "1 m/s² was wanted" in str(window.reason_to_stop(1.0))
    assert f"{np.nanmax(window.sigma[:3]):.2g} m/s² is reached" in str(
        window.reason_to_stop()
    )
    none = Block.of(block.t, np.full_like(block.acc, np.nan), block.gyr)
    assert filled(none).reason_to_stop() is None


def test_averages_say_when_they_were_taken() -> None:
    found = average(block_of(white(np.random.default_rng(21), 100), start=7.0))
    assert (found.start, found.n) == (7.0, 100) and found.temperature == 25.0
    assert found.end == pytest.approx(7.99)
    assert np.isfinite(found.sigma).all()


def test_a_window_one_cell_short_is_told_what_it_needs() -> None:
    with pytest.raises(InputError) as told:
        average(block_of(white(np.random.default_rng(0), 90)))
    assert str(told.value) == (
        "a window of 90 samples over 0.89 s is too short for its mean to have an "
        "error: take 1 s or more"
    )
    short = filled(block_of(white(np.random.default_rng(0), 90)))
    assert short.covariance.shape == (6, 6) and np.isnan(short.covariance).all()


def test_a_slow_device_needs_as_many_samples() -> None:
    """At 1 Hz nothing is missing of 8 s: they are too short."""
    block = block_of(white(np.random.default_rng(0), 8), rate=1.0)
    with pytest.raises(InputError, match="too short for its mean .* take 10 s or more"):
        average(block)
    longer = average(block_of(white(np.random.default_rng(0), 12), rate=1.0))
    assert np.isfinite(longer.sigma).all()


def test_a_disturbance_of_a_slow_device_lasts_as_long_as_it_did() -> None:
    """Of 3.2 s at 5 Hz, which are 16 cells with a sample."""
    x = white(np.random.default_rng(3), 200)
    x[100:116] += 12.0
    moved = rejection(block_of(x, 5.0))
    assert moved is not None and moved.at == pytest.approx(20.0, abs=0.21)
    assert moved.seconds == pytest.approx(3.2)
    what = "turn" if (moved.axis or "").startswith("g") else "push"
    assert f"a 3.2 s {what}" in str(moved)


@pytest.mark.parametrize("rate", [2.0, 50.0])
def test_on_a_base_that_sways_a_window_is_judged_from_the_longest_period_on(
    rate: float,
) -> None:
    """By its time, not by its number of samples: a lean of 2 degrees is no window."""
    x = white(np.random.default_rng(1), round(60 * rate)) / 5
    leans = block_of(x, rate)
    leans.acc[leans.t >= 40, 0] += 0.3
    window = Window(StillnessLimits.swaying())
    window.add(leans.between(0, 15.5))
    assert window.noise is None, "not judged yet"
    window.add(leans.between(15.5, 60))
    moved = window.disturbance
    assert moved is not None and moved.at == pytest.approx(40.0, abs=0.6)


def test_the_error_of_a_mean_does_not_depend_on_a_pause_in_its_window() -> None:
    """Nor does the corner of a low-passed sensor, 0.3 Hz, that shows in it."""
    block = block_of(low_passed(0.3)(np.random.default_rng(5), 6000))
    late = replace(block, t=block.t + 300.0 * (block.t >= 30.0))
    (plain, paused) = (filled(one).covariance for one in (block, late))
    np.testing.assert_allclose(paused, plain, rtol=1e-9)


def test_a_window_of_which_most_is_missing_is_not_called_short() -> None:
    t = np.arange(3000) / 100
    acc = np.where((t < 0.5)[:, None], [0.0, -9.8, 0.1], np.nan)
    with pytest.raises(InputError, match=r"has values in 0\.5 s of it only") as error:
        average(Block.of(t, acc))
    assert "too short" not in str(error.value)


def test_motion_that_is_just_allowed_is_rest() -> None:
    block = block_of(white(np.random.default_rng(22), 3000))
    assert 0.3 < filled(block).motion_now < 1
    assert filled(block).disturbance is None and average(block).n == 3000
