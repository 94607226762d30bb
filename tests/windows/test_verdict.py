"""The verdict on a window: what, when, how long, on which axis, and in which words."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block, Grain
from fieldcal.windows import StillnessLimits, average
from fieldcal.windows import verdict as verdict_module
from fieldcal.windows.cells import CellAccumulator, CellTable
from fieldcal.windows.disturbance import LeastSpread, pushes, shakes, steps
from fieldcal.windows.quiet import QuietNoise, estimate_quiet_noise
from fieldcal.windows.trend import drift_course, robust_lines
from fieldcal.windows.verdict import Departure, WindowVerdict, judge_window
from windows.signals import HOME, UNIT, block_of, white

LIMITS = StillnessLimits()


def table(block: Block) -> CellTable:
    cells = CellAccumulator()
    cells.add(block)
    return cells.table


def rest(n: int = 3000, seed: int = 0) -> Array:
    return white(np.random.default_rng(seed), n)


def verdict(noise: Array, rate: float = 100.0) -> WindowVerdict:
    return judge_window(table(block_of(noise, rate, start=100.0)), LIMITS)


def test_rest_is_below_what_is_allowed_and_hands_on_its_noise() -> None:
    found = verdict(rest())
    assert 0 < found.worst.ratio < 1 and 0 < found.ratio_now < 1
    assert found.quiet is not None and found.quiet.cells == 300
    cells = table(block_of(rest(), start=100.0))
    np.testing.assert_allclose(
        found.quiet.allan, estimate_quiet_noise(cells.means).allan
    )


@pytest.mark.parametrize("channel", [0, 4])
def test_a_push_is_told_with_its_size_place_and_duration(channel: int) -> None:
    x = rest()
    x[1500:1580, channel] += 6.0
    worst = verdict(x).worst
    assert (worst.kind, worst.channel) == ("push", channel)
    assert worst.ratio > 2 and worst.seconds == pytest.approx(0.8)
    assert worst.at == pytest.approx(115.0, abs=0.11)
    assert worst.size == pytest.approx(6.0 * UNIT[channel], rel=0.1)
    assert worst.noise == pytest.approx(UNIT[channel] / np.sqrt(80), rel=0.5)


def test_a_step_is_told_where_it_lies() -> None:
    x = rest()
    x[1500:, 2] -= 3.0
    worst = verdict(x).worst
    assert (worst.kind, worst.channel) == ("step", 2) and worst.ratio > 2
    assert worst.at == pytest.approx(115.0, abs=0.11)
    assert worst.size == pytest.approx(-3.0 * UNIT[2], rel=0.1)


def test_a_shake_is_told_by_its_size_from_sample_to_sample() -> None:
    x = rest()
    x[1500:1540, 5] += 8 * (-1.0) ** np.arange(40)
    worst = verdict(x).worst
    assert (worst.kind, worst.channel) == ("shake", 5)
    assert worst.at == pytest.approx(115.0, abs=0.11)
    assert worst.seconds == pytest.approx(0.4)
    # changes of +-16 have a short-lag noise of 16 / sqrt(2)
    assert worst.size == pytest.approx(16 / np.sqrt(2) * UNIT[5], rel=0.15)
    assert worst.noise == pytest.approx(UNIT[5], rel=0.1)


def test_a_drift_is_told_by_its_change_over_the_window() -> None:
    x = rest()
    x[:, 1] += np.linspace(0, 10.0, 3000)
    worst = verdict(x).worst
    assert (worst.kind, worst.channel, worst.at) == ("drift", 1, 100.0)
    assert worst.size == pytest.approx(10.0 * UNIT[1], rel=0.1)
    assert worst.seconds == pytest.approx(30.0)
    # a change is allowed for by the limit and by what the noise can pretend
    cells = table(block_of(x, start=100.0))
    longest = estimate_quiet_noise(cells.means).allan[-1, 1]
    laid = robust_lines(cells.means)[:, 1]
    assert worst.size == pytest.approx(laid[-1] - laid[0], rel=1e-9)
    assert worst.noise == pytest.approx(longest)
    assert worst.ratio == pytest.approx(worst.size / (0.1 + 5.8 * longest))


@pytest.mark.parametrize("seed", range(20))
def test_a_device_that_warms_up_was_not_moved(seed: int) -> None:
    """6 mm/s^2 in half a minute, where two means of 13 s differ by a tenth of that."""
    rng = np.random.default_rng(seed)
    x = 0.1 * rest(seed=seed)
    x += rng.uniform(-0.6, 0.6, 6) * np.exp(-np.arange(3000)[:, None] / 36_000) / 0.08
    assert verdict(x).worst.ratio < 1
    x[1800:, 2] += 0.3
    worst = verdict(x).worst
    assert (worst.kind, worst.channel) == ("step", 2) and worst.ratio > 1
    assert worst.at == pytest.approx(118.0, abs=1.6)
    assert worst.size > 0


def test_what_no_device_at_rest_does_is_told_by_the_limit() -> None:
    t = np.arange(3000)[:, None] / 100
    x = rest() + 40 * np.sin(2 * np.pi * 0.7 * t) * (np.arange(6) == 0)
    worst = verdict(x).worst
    assert (worst.kind, worst.channel, worst.seconds) == ("noise", 0, 0.1)
    assert worst.noise == LIMITS.acc and worst.size > 2.0 / np.sqrt(2)
    assert worst.ratio == pytest.approx(worst.size / LIMITS.acc)
    cells = table(block_of(x, start=100.0))
    assert worst.size == pytest.approx(estimate_quiet_noise(cells.means).spread[0, 0])
    assert worst.at == cells.times[np.argmax(abs(cells.means[:, 0]))]


def test_a_stuck_channel_is_told_with_its_run() -> None:
    block = block_of(rest(), start=100.0)
    block.acc[1800:2600, 0] = block.acc[1800, 0]
    found = judge_window(table(block), LIMITS)
    worst = found.worst
    assert (worst.kind, worst.channel, worst.size) == ("stuck", 0, 0.0)
    assert worst.ratio == np.inf and worst.noise == pytest.approx(UNIT[0], rel=0.2)
    assert worst.at == pytest.approx(118.1) and worst.seconds == pytest.approx(7.9)


def test_a_channel_that_is_dead_beside_noisy_ones_is_stuck() -> None:
    block = block_of(rest(), start=100.0)
    block.gyr[:, 1] = 0.25
    worst = judge_window(table(block), LIMITS).worst
    assert (worst.kind, worst.channel) == ("stuck", 4)


def test_a_device_coarser_than_its_noise_is_not_stuck() -> None:
    block = block_of(rest(), start=100.0)
    block.acc[:] = np.round(block.acc)
    block.gyr[:] = 0.0
    assert judge_window(table(block), LIMITS).worst.ratio < 1


@pytest.mark.parametrize(
    ("rate", "noise"),
    [
        (10.0, 0.25),
        (50.0, 0.55),
        *(
            pytest.param(rate, noise, marks=pytest.mark.thorough)
            for rate in (10.0, 20.0, 50.0)
            for noise in (0.25, 0.4, 0.55, 0.8)
            if (rate, noise) not in ((10.0, 0.25), (50.0, 0.55))
        ),
    ],
)
def test_values_that_flicker_between_coarse_steps_are_at_rest(
    rate: float, noise: float
) -> None:
    """Where most neighbours are alike, their median difference tells of no noise."""
    rng, passed, pushed, runs = np.random.default_rng(int(rate)), 0, 0, 30
    second = int(rate)
    for _ in range(runs):
        drawn = noise * rng.normal(size=(24 * second, 6))
        x = np.round(rng.uniform(-0.5, 0.5, 6) + drawn)
        passed += verdict(x, rate).worst.ratio <= 1
        x[12 * second : 13 * second, 2] += 6.0
        pushed += verdict(x, rate).worst.ratio > 1
    assert passed >= runs - 3 and pushed == runs


def allowed(cells: float) -> float:
    """Twice as much in a window of 8 s as in a long one."""
    return 5.8 * (1 + (8.0 / (0.1 * cells)) ** 2)


@pytest.mark.parametrize("n", [300, 800, 3000])
def test_the_ratio_is_the_largest_departure_over_what_is_allowed(n: int) -> None:
    cells = table(block_of(rest(n, seed=n), start=100.0))
    found = judge_window(cells, LIMITS)
    noise, means = estimate_quiet_noise(cells.means), cells.means
    least = LeastSpread(np.zeros(6), np.zeros(6), np.ones(6))
    tests = [
        *pushes(means - robust_lines(means), noise, least),
        *steps(means - drift_course(means, robust_lines(means)), noise, least),
        *shakes(cells.short_lag_variance, cells.step_counts, least),
    ]
    bound = allowed(len(cells))
    largest = max(test.z.max() for test in tests) / bound
    recent = max(test.z[-10:].max() for test in tests if test.cells < 10) / bound
    assert found.worst.ratio == pytest.approx(largest)
    assert found.ratio_now == pytest.approx(recent)


def test_windows_before_sharpen_the_judgement() -> None:
    first = verdict(rest(6000, seed=1))
    x = rest(400, seed=2)
    x[200:250, 1] += 4.0
    cells = table(block_of(x))
    alone, after = judge_window(cells, LIMITS), judge_window(cells, LIMITS, first.quiet)
    assert alone.worst.ratio < 1 < after.worst.ratio
    assert after.quiet is not None and after.quiet.cells == 640


def test_the_last_cell_does_not_count_while_it_fills() -> None:
    x = rest(3003)
    x[3000:] += 50.0
    found = verdict(x)
    assert found.worst.ratio < 1 and found.ratio_now < 1
    assert found.quiet is not None and found.quiet.cells == 300


@pytest.mark.parametrize(("n", "judged"), [(290, False), (300, True)])
def test_three_seconds_are_judged_by_their_own_noise(n: int, judged: bool) -> None:
    before = QuietNoise(np.ones((3, 6)), 30)
    cells = table(block_of(rest(n), start=100.0))
    found = judge_window(cells, LIMITS, before)
    assert (found.ratio_now > 0) == judged
    assert (found.quiet is not before) == judged
    if not judged:
        scatter = cells.means.std(axis=0) / LIMITS.noise
        assert found.worst.kind == "noise" and found.ratio_now == 0.0
        assert found.worst.ratio == pytest.approx(scatter.max())
        assert found.worst.channel == np.argmax(scatter)


def test_of_nothing_nothing_is_said() -> None:
    found = judge_window(CellAccumulator().table, LIMITS)
    assert (found.worst.ratio, found.ratio_now, found.quiet) == (0.0, 0.0, None)
    assert np.isnan(found.worst.at)


def test_jumps_that_come_of_rounding_are_no_disturbance() -> None:
    block = block_of(0.001 * rest(), start=100.0)
    block.acc[1500:1520, 1] += 0.02
    block.acc[2000:2001, 1] += 1e-4
    told = np.repeat([0.03, 0.0], 3)
    cells = table(block)
    alone, with_steps = (
        judge_window(cells, LIMITS),
        judge_window(cells, LIMITS, None, told),
    )
    assert alone.worst.ratio > 1 > with_steps.worst.ratio
    # jumps that the values show themselves are allowed for without being told
    coarse = block_of(rest(), start=100.0)
    coarse.acc[:] = HOME[:3]
    coarse.acc[1500:1530, 1] += 0.3
    for told_or_not in (None, np.zeros(6)):
        assert (
            judge_window(table(coarse), LIMITS, None, told_or_not).worst.ratio <= 1.01
        )


def said(departure: Departure) -> str:
    moved = departure.as_error(100.0)
    assert moved.at == departure.at
    assert moved.axis == ["ax", "ay", "az", "gx", "gy", "gz"][departure.channel]
    return str(moved)


@pytest.mark.parametrize(
    ("departure", "text"),
    [
        (
            Departure(2.0, "push", 1, 112.5, 0.8, 0.3, 0.02),
            "disturbed 12.5 s into the window on ay: a 0.8 s push of "
            "+0.30 ± 0.02 m/s², 15 times the noise",
        ),
        (
            Departure(2.0, "step", 3, 112.5, 0.8, -0.004, 0.0005),
            "disturbed 12.5 s into the window on gx: a lasting change of "
            "-0.0040 ± 0.0005 rad/s, 8 times the noise",
        ),
        (
            Departure(2.0, "push", 4, 112.5, 1.6, 0.2, 1.2e-4),
            "disturbed 12.5 s into the window on gy: a 1.6 s turn at "
            "+0.2000 ± 0.0001 rad/s, 1667 times the noise",
        ),
        (
            Departure(2.0, "shake", 2, 112.5, 0.4, 0.25, 0.05),
            "disturbed 12.5 s into the window on az: shaken for 0.4 s by "
            "0.25 m/s², 5 times the noise",
        ),
        (
            Departure(2.0, "push", 0, 112.5, 0.8, 0.3, 0.0),
            "disturbed 12.5 s into the window on ax: a 0.8 s push of "
            "+0.3 ± 0 m/s², where the noise is 0 m/s²",
        ),
        (
            Departure(2.0, "drift", 2, 100.0, 30.0, 0.4, 0.01),
            "creeping on az: +0.40 ± 0.01 m/s² over the window",
        ),
        (
            Departure(2.0, "noise", 5, 100.0, 0.1, 0.3, 0.1),
            "moving on gz by 0.3 rad/s, which no device at rest does",
        ),
        (
            Departure(np.inf, "stuck", 0, 118.0, 7.9, 0.0, 0.05),
            "ax repeats one value for 7.9 s from 18.0 s into the window: "
            "its sensor is stuck",
        ),
    ],
)
def test_the_operator_is_told_what_when_where_and_by_how_much(
    departure: Departure, text: str
) -> None:
    assert said(departure) == text


MG = 9.80665e-3


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("declared", [False, True])
def test_a_stream_of_whole_steps_without_noise_is_at_rest(
    cut: bool, declared: bool
) -> None:
    """Behind a filter a value goes from one step to the next, and stays there."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        creeps = 1e-3 * np.cumsum(rng.normal(0, 0.02, (1500, 3)), axis=0)
        acc = np.array([0.02, -9.8, 0.3]) + rng.uniform(-MG, MG, 3) + creeps
        whole = np.trunc(acc / MG) if cut else np.round(acc / MG)
        sent = (whole + 0.5 * np.sign(whole) * cut) * MG
        block = Block.of(np.arange(1500) / 50, sent, np.full((1500, 3), 0.01))
        found = average(block, grain=Grain(MG, 1e-3, cut) if declared else None)
        if declared:
            assert (
                np.abs(found.mean[:3] - acc.mean(axis=0)) < 4 * found.sigma[:3]
            ).all()


@pytest.mark.parametrize(
    ("channel", "what"), [(2, "a 0.6 s push of 5"), (3, "a 0.6 s turn at 5")]
)
def test_a_gyroscope_is_turned_and_an_accelerometer_pushed(
    channel: int, what: str
) -> None:
    departure = Departure(4.0, "push", channel, 12.0, 0.6, 0.5, 0.01)
    assert departure._push("5") == what


def test_lines_go_through_means_with_the_step_of_a_mean(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A mean of ten values that are whole steps is a whole tenth of a step."""
    seen: list[Array | None] = []

    def lines(means: Array, step: Array | None = None) -> Array:
        seen.append(step)
        return robust_lines(means, step)

    monkeypatch.setattr(verdict_module, "robust_lines", lines)
    step = np.repeat([0.05, 0.004], 3)
    block = block_of(rest(), start=100.0)
    coarse = np.round(block.six / step) * step
    coarse[:, 3:] = step[3:]  # which never changes
    judge_window(table(Block.of(block.t, coarse[:, :3], coarse[:, 3:])), LIMITS)
    (found,) = seen
    assert found is not None
    np.testing.assert_allclose(found, np.repeat([0.005, 0.0], 3), atol=1e-12)


def test_values_that_seldom_change_spread_by_how_many_do() -> None:
    """One in ten or in five, by one step or by many: counted pair by pair."""
    rng, every = np.random.default_rng(5), np.array([0.1, 0.2, 0.05, 0.1, 0.3, 0.02])
    there = rng.random((4000, 6)) < every / 2
    six = 0.25 * there
    cells = table(Block.of(np.arange(4000) / 100, six[:, :3], six[:, 3:]))
    found = verdict_module._least_spreads(cells, np.full(6, 7.0))
    changed = (np.diff(six, axis=0) != 0).mean(axis=0)
    np.testing.assert_allclose(changed, every * (1 - every / 2), rtol=0.25)
    p = (2 - np.sqrt(4 - 6 * changed)) / 3
    np.testing.assert_allclose(found.sampled, 0.25 * np.sqrt(p), rtol=0.02)
    np.testing.assert_array_equal(found.number, 10.0)
    np.testing.assert_array_equal(found.always, 7.0)
