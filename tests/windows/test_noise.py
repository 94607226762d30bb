"""The one measurement of white noise, on noise of known level and slow sums."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import truncnorm

from fieldcal.core.samples import ACC, GYR, Array, Block
from fieldcal.windows import noise
from fieldcal.windows.noise import (
    is_to_and_fro,
    measure_noise,
    quickest_noise,
    short_lag_noise,
    smallest_steps,
)
from windows.signals import flicker, low_passed, white

RATE = 100.0


def walk(n: int, c: int, seed: int = 0) -> Array:
    steps = np.random.default_rng(seed).standard_normal((n, c))
    return np.asarray(np.cumsum(steps, axis=0))


def test_the_level_of_white_noise_is_its_deviation() -> None:
    size = np.array([0.05, 0.002, 3.0])
    x = white(np.random.default_rng(0), 60_000, 3) * size
    found = measure_noise([x], RATE)
    np.testing.assert_allclose(found.white, size, rtol=0.02)
    np.testing.assert_allclose(found.quick, size, rtol=0.02)


def test_a_drift_and_the_steps_between_windows_are_no_noise() -> None:
    rng = np.random.default_rng(1)
    lean = np.linspace(0, 100, 6000)[:, None]
    pieces = [white(rng, 6000, 2) + lean * k + 50 * k for k in range(4)]
    np.testing.assert_allclose(measure_noise(pieces, RATE).white, 1.0, rtol=0.04)


def test_a_tenth_that_is_disturbed_does_not_count() -> None:
    x = white(np.random.default_rng(2), 30_000, 1)
    x[10_000:10_500] += 40 * np.sin(np.arange(500) / 7.0)[:, None]
    found = measure_noise([x], RATE)
    assert found.white[0] == pytest.approx(1.0, abs=0.06)
    assert found.quick[0] == pytest.approx(1.0, abs=0.06)


def test_the_tenth_that_is_left_out_is_allowed_for() -> None:
    edge = 1.6448536269514722
    assert noise.KEEP == 0.9
    assert noise.CENTRAL_SECOND_MOMENT == pytest.approx(
        truncnorm(-edge, edge).var(), abs=1e-5
    )


def test_filtered_outputs_are_not_taken_for_quieter_ones() -> None:
    x = low_passed(10.0)(np.random.default_rng(3), 60_000, 2)
    means = x.reshape(-1, 100, 2).mean(axis=1)
    found = measure_noise([x], RATE)
    np.testing.assert_allclose(found.white, 10 * means.std(axis=0), rtol=0.12)
    assert (found.quick < 0.35 * found.white).all()


def test_white_noise_under_a_walk_is_what_the_levels_rise_from() -> None:
    rng = np.random.default_rng(4)
    x = white(rng, 60_000, 2) + 0.03 * walk(60_000, 2)
    found = measure_noise([x], RATE)
    np.testing.assert_allclose(found.white, 1.0, rtol=0.05)
    # what rises from the first sample on has no white noise under it
    assert (measure_noise([walk(60_000, 2)], RATE).white > 3).all()


def slow(pieces: list[Array], m: int) -> tuple[float, float]:
    """(1) of one channel, bend by bend, less the largest tenth; its relative error."""
    bends = []
    for piece in pieces:
        if len(piece) < 3 * m:
            continue
        means = [piece[k * m : (k + 1) * m].mean() for k in range(len(piece) // m)]
        bends += [
            means[k + 2] - 2 * means[k + 1] + means[k] for k in range(len(means) - 2)
        ]
    squares = np.sort([m * b**2 / 6 for b in bends if np.isfinite(b)])
    kept = squares[: int(np.ceil(0.9 * len(squares)))]
    return float(np.mean(kept) / noise.CENTRAL_SECOND_MOMENT), float(
        np.sqrt(6 / len(squares))
    )


@pytest.mark.parametrize("missing", [False, True])
def test_the_level_of_single_samples_is_the_slow_one(missing: bool) -> None:
    rng = np.random.default_rng(5)
    pieces = [white(rng, 400, 2), white(rng, 90, 2), white(rng, 2, 2)]
    pieces += [3 * white(rng, 3, 2) for _ in range(30)]
    if missing:
        pieces[0][50:60, 0] = np.nan
        pieces[1][3, 1] = np.nan
    quick = measure_noise(pieces, RATE).quick
    for c in range(2):
        expected, _ = slow([p[:, c] for p in pieces], 1)
        assert quick[c] == pytest.approx(np.sqrt(expected))


def test_levels_that_agree_end_with_the_shortest() -> None:
    x = [white(np.random.default_rng(6), 2000, 1)]
    levels = [slow([x[0][:, 0]], m)[0] for m in (100, 25, 6, 1)]
    assert measure_noise(x, RATE).white[0] == pytest.approx(np.sqrt(levels[-1]))


def test_levels_that_do_not_agree_end_with_the_last_that_did() -> None:
    """Means over 25 and more obey one level; single samples are quieter."""
    x = low_passed(5.0)(np.random.default_rng(7), 40_000, 1)
    levels = {m: slow([x[:, 0]], m)[0] for m in (100, 25, 6, 1)}
    assert levels[6] < 0.7 * levels[25]
    found = measure_noise([x], RATE).white[0] ** 2
    assert found == pytest.approx(levels[100]) or found == pytest.approx(levels[25])


def test_the_line_under_a_walk_goes_through_the_two_longest_levels() -> None:
    x = white(np.random.default_rng(8), 80_000, 1) + 0.05 * walk(80_000, 1, 9)
    (long, _), (short, _) = (slow([x[:, 0]], m) for m in (100, 25))
    slope = (long - short) / (100**2 - 25**2)
    expected = np.sqrt(short - slope * 25**2)
    assert measure_noise([x], RATE).white[0] == pytest.approx(expected, rel=1e-9)
    # three levels are the fewest that show whether they obey it
    x += 0.3 * walk(80_000, 1, 10)
    (long, _), (short, _) = (slow([x[:, 0]], m) for m in (16, 4))
    expected = np.sqrt(short - (long - short) / (16**2 - 4**2) * 4**2)
    assert measure_noise([x], 16.0).white[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("rate", "length", "period"),
    [(10.0, 16_000, 10), (10.4, 16_000, 10), (100.0, 80, 10)],
)
def test_the_longest_means_are_over_a_second_or_an_eighth_of_the_window(
    rate: float, length: int, period: int
) -> None:
    """A sway that means over so many samples do not see, and shorter ones do."""
    t = np.arange(length)[:, None]
    rng = np.random.default_rng(10)
    pieces = [
        0.01 * white(rng, length, 1) + np.cos(2 * np.pi * (t + 0.5) / period)
        for _ in range(16_000 // length)
    ]
    assert measure_noise(pieces, rate).white[0] == pytest.approx(0.01, rel=0.1)
    assert measure_noise(pieces, 1.3 * rate if length > 80 else 7.0).white[0] > 0.1


def test_samples_that_come_once_in_seconds_are_taken_one_by_one() -> None:
    x = low_passed(10.0)(np.random.default_rng(10), 9000, 1)
    expected, _ = slow([x[:, 0]], 1)
    for pieces, rate in ([x], 0.2), ([*x.reshape(-1, 15, 1)], RATE):
        found = measure_noise(pieces, rate)
        assert found.white[0] == found.quick[0]
        assert found.quick[0] == pytest.approx(np.sqrt(expected), rel=0.1)
    # from means over 8 or 2 it goes down to 1 as well
    for rate in (8.0, 2.0):
        assert measure_noise([x], rate).quick[0] == pytest.approx(np.sqrt(expected))


def test_outputs_coarser_than_their_noise_are_as_noisy_as_their_steps() -> None:
    x = np.round(0.2 * white(np.random.default_rng(11), 5000, 2)) * [1.0, 2.0]
    x[:, 0] = np.where(np.arange(5000) == 700, 1.0, 0.0)
    found = measure_noise([x], RATE)
    least = 1 / np.sqrt(12)
    assert found.white[0] == pytest.approx(least)
    assert found.quick[0] == pytest.approx(least)
    assert found.quick[1] >= 2 * least


def test_what_was_not_measured_is_not_known() -> None:
    x = white(np.random.default_rng(12), 500, 2)
    x[:, 1] = np.nan
    found = measure_noise([x], RATE)
    assert np.isfinite([found.white[0], found.quick[0]]).all()
    assert np.isnan([found.white[1], found.quick[1]]).all()
    # three bends are no measurement, four are
    for n, known in ((5, False), (6, True)):
        found = measure_noise([white(np.random.default_rng(13), n, 1)], RATE)
        assert np.isfinite(found.quick[0]) == known
    assert np.isnan(measure_noise([np.ones((2, 1))], RATE).quick).all()


def test_where_the_long_means_are_missing_the_shorter_ones_tell() -> None:
    x = white(np.random.default_rng(14), 900, 1)
    x[::40] = np.nan
    expected, _ = slow([x[:, 0]], 1)
    assert measure_noise([x], RATE).white[0] == pytest.approx(
        np.sqrt(expected), rel=0.4
    )


def test_of_many_samples_some_evenly_spread_ones_tell(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    x = white(np.random.default_rng(15), 60_000, 2)
    # what lies in one place only must not be missed or be taken for the whole
    x[30_000:] *= 3.0
    whole = measure_noise([x], RATE).quick
    monkeypatch.setattr(noise, "MOST_DIFFERENCES", 2000)
    some = measure_noise([x], RATE).quick
    np.testing.assert_allclose(some, whole, rtol=0.1)
    assert (some != whole).any()
    three = [x[k : k + 9].reshape(3, 3, 2).mean(axis=1) for k in range(0, 900, 9)]
    monkeypatch.setattr(noise, "MOST_DIFFERENCES", 99)
    bends = np.diff([x[k : k + 3] for k in range(0, 900, 9)], 2, axis=1)[:, 0]
    assert len(three) == len(bends) == 100
    squares = np.sort(bends**2 / 6, axis=0)[:90]
    found = measure_noise([x[:900]], 1.0).quick
    np.testing.assert_allclose(
        found**2, squares.mean(axis=0) / noise.CENTRAL_SECOND_MOMENT
    )


def test_the_short_lag_noise_is_half_the_square_of_the_changes() -> None:
    x = np.array([[0.0, 1.0], [2.0, np.nan], [1.0, 4.0], [1.0, 8.0]])
    np.testing.assert_allclose(short_lag_noise(x), [np.sqrt(5 / 6), np.sqrt(8)])
    np.testing.assert_allclose(short_lag_noise(x[:, :1]), [np.sqrt(5 / 6)])
    gone = short_lag_noise(np.column_stack([x[:, 0], np.full(4, np.nan)]))
    assert gone[0] == pytest.approx(np.sqrt(5 / 6)) and np.isnan(gone[1])
    assert np.isnan(short_lag_noise(x[:1])).all()


def test_the_step_is_the_smallest_change_in_any_window() -> None:
    pieces = [np.array([[0.0, 1], [4, 1], [4, 1]]), np.array([[8.0, 1], [10, 1]])]
    np.testing.assert_array_equal(smallest_steps(pieces), [2, 0])
    np.testing.assert_array_equal(
        smallest_steps([*pieces, np.array([[3.0, 9]])]), [2, 0]
    )
    np.testing.assert_array_equal(smallest_steps([np.ones((1, 2))]), [0, 0])
    # two samples are enough, a missing one is no change
    assert smallest_steps([np.array([[0.0], [0.5]])]) == 0.5
    assert smallest_steps([np.array([[0.0], [np.nan], [0.5], [0.75]])]) == 0.25


def test_the_step_is_looked_for_at_the_beginning_of_each_window() -> None:
    x = np.zeros((2500, 1))
    x[1000] = 1.0
    x[2200] = 0.25
    assert smallest_steps([x]) == 1.0
    assert smallest_steps([x, x[1000:]]) == 0.25


def trembling(n: int, seed: int, hz: tuple[float, float] = (1.0, 8.0)) -> Array:
    """Rate of an angle that trembles about each axis with an rms of 1, (n, 3)."""
    rng, t = np.random.default_rng(seed), np.arange(n) / RATE
    out = np.zeros((n, 3))
    for _ in range(8):
        f = rng.uniform(*hz, 3)
        phase = np.multiply.outer(t, 2 * np.pi * f) + rng.uniform(0, 6.3, 3)
        out += 0.5 * 2 * np.pi * f * np.cos(phase)
    return out


@pytest.mark.parametrize("seed", range(4))
def test_what_trembles_comes_back_and_no_noise_of_a_sensor_does(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pieces = [trembling(500, seed * 9 + i) + white(rng, 500, 3) for i in range(6)]
    assert is_to_and_fro(pieces)
    noises = [white(rng, 500, 3) for _ in range(6)]
    assert not is_to_and_fro(noises)
    assert not is_to_and_fro([low_passed(6.0)(rng, 500, 3) for _ in range(6)])
    assert not is_to_and_fro([flicker(2.0)(rng, 500, 3) for _ in range(6)])
    assert not is_to_and_fro([walk(500, 3, i) for i in range(6)])
    assert not is_to_and_fro([p + walk(500, 3, i) for i, p in enumerate(noises)])
    assert not is_to_and_fro([p + 0.005 * trembling(500, 3) for p in noises]), (
        "too weak"
    )


def test_of_next_to_nothing_nobody_can_tell() -> None:
    assert not is_to_and_fro([])
    assert not is_to_and_fro([trembling(9, 1)])
    assert not is_to_and_fro([np.full((500, 3), np.nan)])


def test_the_quickest_noise_is_that_of_fourth_differences() -> None:
    """By a slow sum, with samples that are missing; what is slow leaves nothing."""
    x = white(np.random.default_rng(4), 400, 2) * [1.0, 0.3]
    x[100] = np.nan
    found = quickest_noise([x[:150], x[150:]])
    for c in range(2):
        squares = [
            (x[i - 2, c] - 4 * x[i - 1, c] + 6 * x[i, c] - 4 * x[i + 1, c]
             + x[i + 2, c]) ** 2
            for part in (range(150), range(150, 400))
            for i in part[2:-2]
        ]  # fmt: skip
        assert found[c] == pytest.approx(np.sqrt(np.nanmean(squares) / 70))
    size = np.array([0.5, 0.01, 2.0])
    quiet = white(np.random.default_rng(5), 20_000, 3) * size
    np.testing.assert_allclose(quickest_noise([quiet]), size, rtol=0.03)
    slow = trembling(20_000, 2) / 40
    np.testing.assert_allclose(
        quickest_noise([quiet[:, :1] + slow[:, :1]]), 0.5, rtol=0.03
    )


@pytest.mark.parametrize(("walks", "sees"), [(True, 2.0), (False, None)])
def test_white_noise_under_a_walk_is_the_rest_of_a_square(
    walks: bool, sees: float | None
) -> None:
    """Levels of 4 and what grows with the square of a length; not with the length."""
    lengths = (1, 2, 4, 8)
    grown = np.array([1.0, 4.0, 16.0, 64.0] if walks else [1.0, 2.0, 4.0, 8.0])
    found = noise._white_under_walk(lengths, 4 + 9 * grown, np.full(4, 0.02))
    assert found == (sees and pytest.approx(sees))


def test_of_many_squares_exactly_the_largest_tenth_is_left_out() -> None:
    x = white(np.random.default_rng(12), 6001, 1)
    expected, _ = slow([x[:, 0]], 1)
    assert noise._level([x], 1)[0][0] == pytest.approx(expected, rel=1e-10)


def test_a_walk_shows_between_the_two_longest_means() -> None:
    """Where these agree within three standard errors, a rise beyond is none."""
    lengths, spreads = (8, 4, 2, 1), np.full(4, 0.02)
    for slope, walks in ((0.0070, False), (0.0085, True)):
        levels = 4 + slope * np.square(lengths, dtype=float)
        apart = abs(levels[0] - levels[1]) / (np.hypot(0.02, 0.02) * levels[0])
        assert (apart > 3) == walks
        assert abs(levels[0] - levels[2]) > 3 * np.hypot(0.02, 0.02) * levels[0]
        found = noise._white_under_walk(lengths, levels, spreads)
        assert found == (pytest.approx(2.0) if walks else None)


def test_a_converter_leaves_a_part_of_what_the_triad_measures() -> None:
    """Each triad has its own full scale; wrong words and missing values are none."""
    rng = np.random.default_rng(8)
    six = rng.uniform(-1, 1, (5000, 6)) * [9.8, 0.1, 0.1, 0.0, 0.02, 0.5]

    def block_of(six: Array) -> Block:
        return Block.of(np.arange(5000.0), six[:, ACC], six[:, GYR])

    plain = noise.converter_noise(block_of(six))
    scale = 2 * 2**-23.5
    assert plain[:3] == pytest.approx(scale * np.quantile(np.abs(six[:, :3]), 0.99))
    assert plain[3:] == pytest.approx(scale * np.quantile(np.abs(six[:, 3:]), 0.99))
    assert 1e-6 < plain[0] < 2e-6
    six[::1000, 1] = 1e30
    six[5, 0] = np.nan
    assert noise.converter_noise(block_of(six)) == pytest.approx(plain, rel=0.05)
    six[:, 3:] = np.nan
    assert (noise.converter_noise(block_of(six))[3:] == 0).all()
