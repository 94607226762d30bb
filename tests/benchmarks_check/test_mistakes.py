"""Mistakes of the campaign do what they say, by truths that know none of their code."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.never_wrong import GROUPED, SOUND
from benchmarks.never_wrong.bench import Bench, Floats, Samples, drawn
from benchmarks.never_wrong.bench_mistakes import BEFORE, spoilt
from benchmarks.never_wrong.device import Device
from benchmarks.never_wrong.mistakes import AFTER, session
from benchmarks.never_wrong.recording import recorded
from benchmarks.never_wrong.written import Written, acting

NONE = np.zeros(3)
IDEAL = Device(
    np.zeros((2, 3, 3)), NONE, NONE, NONE, np.zeros((3, 3)), np.zeros((3, 3)), 0.0
)


def _ideal(places: str = "wide", **more: object) -> Bench:
    """A bench and a device without any error."""
    seeds = map(np.random.default_rng, range(100))
    bench = next(b for b in map(drawn, seeds) if b.places == places)
    one = np.ones(3)
    bench = replace(
        bench, device=IDEAL, acc_bias=NONE, acc_scale=one, gyr_bias=NONE,
        gyr_scale=one, acc_noise=0.0, gyr_noise=0.0, grain=0.0, off=0 * bench.off,
        tilt=(0.0, 0.0), mounting=("+x", "+y", "+z"), rate=100.0,
    )  # fmt: skip
    return replace(bench, **more)  # type: ignore[arg-type]


def _samples(bench: Bench) -> Samples:
    return recorded(bench, np.random.default_rng(0))


def _made(name: str, bench: Bench, seed: int = 0) -> Written:
    return session(bench, (name,), np.random.default_rng(seed))


def _means(bench: Bench, s: Samples) -> Floats:
    """Mean acceleration of each position's last 10 s."""
    return np.array([s.acc[s.within(b - 10, b)].mean(axis=0) for _, b in bench.windows])


def test_each_mistake_has_a_row_of_the_table() -> None:
    named = [name for names in GROUPED.values() for name in names]
    assert sorted(named) == sorted([SOUND, *BEFORE, *AFTER])


def test_joints_that_are_not_square_turn_about_axes_that_are_not() -> None:
    """A joint on a joint, by SciPy's rotations; aligned with the base at zero."""
    skew = 0.3
    bench = _ideal(skew=skew)
    means = _means(bench, _samples(bench))
    second = np.array([np.cos(skew), 0.0, -np.sin(skew)])
    for (alpha, beta), seen in zip(np.deg2rad(bench.angles), means, strict=True):
        turn = Rotation.from_rotvec([0.0, 0.0, alpha])
        body = turn * Rotation.from_rotvec(beta * second)
        up = body.inv().apply([0.0, -bench.gravity, 0.0])
        assert seen == pytest.approx(up, abs=1e-9)


@pytest.mark.parametrize(
    "more", [{"skew": 0.2}, {"creep": 0.05, "creeps_s": 4.0}], ids=["skew", "creep"]
)
def test_rates_lead_from_one_position_to_the_next(more: dict[str, float]) -> None:
    """Gravity, carried by rates alone for some 10 s, in which the Earth turns 7e-4."""
    bench = _ideal("five", **more)
    s = _samples(bench)
    for (_, end), (start, _) in pairwise(bench.windows):
        some = s.within(end, start)
        force, rates = s.acc[some][0], s.gyr[some]
        for rate in (rates[1:] + rates[:-1]) / 2:
            force = Rotation.from_rotvec(-rate / bench.rate).apply(force)
        assert force == pytest.approx(s.acc[some][-1], abs=0.01)


def test_a_joint_that_settles_has_come_back_at_the_end() -> None:
    bench = _ideal("five", creep=np.deg2rad(0.5), creeps_s=2.0)
    s, plain = _samples(bench), _samples(replace(bench, creep=0.0))
    start, end = bench.windows[1]
    off = np.linalg.norm(s.acc - plain.acc, axis=1)
    assert off[s.within(start, start + 0.1)].min() > 0.01
    assert off[s.within(end - 1, end)].max() < 1e-3
    assert off[s.within(0, start - bench.way)].max() == 0


def test_what_acts_at_times_does_not_act_between() -> None:
    quiet = _ideal("five")
    span = tuple(float(s) for s in quiet.windows[2])
    bench = acting(quiet, shaken=1.0, hum_hz=20.0, swaying=0.01, sway_hz=2.0,
                   spans=(span,))  # fmt: skip
    more, s = _samples(bench).acc - _samples(quiet).acc, _samples(quiet)
    inside = s.within(span[0] + 0.3, span[1])
    assert more[inside].std() > 0.1
    assert np.abs(more[~s.within(span[0], span[1] + 0.3)]).max() < 1e-12


def test_the_sun_changes_biases_and_what_is_true_of_them() -> None:
    device = replace(IDEAL, warm=np.full((3, 3), 1e-3), heated=10.0, heated_s=50.0)
    assert device.warmth(np.array([0.0, 50.0])) == pytest.approx([0.0, 0.0])
    there = 10.0 * (1 - np.exp(-100.0 / 300.0))
    assert device.come_to(150.0)["acc_bias"] == pytest.approx(np.full(3, there * 1e-3))


def test_a_position_that_was_not_taken_is_the_one_before() -> None:
    bench = spoilt(_ideal("six_faces"), ("not turned",), np.random.default_rng(3))
    moves = np.linalg.norm(np.diff(_means(bench, _samples(bench)), axis=0), axis=1)
    assert np.count_nonzero(moves < 1e-9) == 1


@pytest.mark.parametrize(
    "said", ["angles exchanged", "an angle counted the other way", "angles in radians",
             "angles in gon, mil or mrad", "angles as a slope", "a sign forgotten"],
)  # fmt: skip
def test_angles_that_are_said_wrongly_may_be_of_fewer_positions(said: str) -> None:
    bench = _ideal("five")
    both = session(bench, ("a position forgotten", said), np.random.default_rng(1))
    alone = _made("a position forgotten", bench, 1)
    rows, before = both.about["position"], alone.about["position"]
    assert len(rows) == len(before) == len(_made(said, bench).about["position"]) - 1
    assert rows != before


def test_play_is_on_the_side_that_a_joint_comes_from() -> None:
    bench = spoilt(_ideal("wide"), ("play of the joints",), np.random.default_rng(3))
    size = np.abs(bench.off).max()
    # (-45,-5) (-45,5) (0,0) (45,-5) (45,5), then faces that are laid by hand
    signs = [(0, 0), (0, -1), (-1, 1), (-1, 1), (-1, -1), (0, 0), (0, 0), (0, 0)]
    assert bench.off == pytest.approx(size * np.array(signs))


def test_two_recordings_in_one_leave_each_position_in_its_window() -> None:
    """The last position is of the device; the first has another bias by up to 0.1."""
    bench = _ideal("six_faces", level_deg=1e-6)
    honest = _means(bench, _samples(bench))
    for seed in range(6):
        made = _made("two days joined", bench, seed)
        s, rows = made.samples, made.about["position"]
        ends = np.array([(row["start_s"], row["end_s"]) for row in rows])
        assert np.diff(s.t).min() > 0 and s.t[-1] > ends[-1, 1]
        seen = [s.acc[s.within(a, b)].mean(axis=0) for a, b in ends]
        assert seen[-1] == pytest.approx(honest[-1], abs=1e-9)
        assert 1e-4 < np.abs(seen[0] - honest[0]).max() < 1.0


def test_a_device_that_is_remounted_is_turned_by_a_quarter() -> None:
    bench = _ideal("two")
    first = _made("device remounted", bench).samples.acc[0]
    angle = first @ _samples(bench).acc[0] / bench.gravity**2
    assert abs(angle) in (pytest.approx(0.0, abs=1e-9), pytest.approx(1.0))
    assert np.linalg.norm(first) == pytest.approx(bench.gravity)


def test_values_sent_on_change_are_never_off_by_more_than_the_bar() -> None:
    bench = replace(_ideal("two"), acc_noise=1e-2, gyr_noise=1e-3)
    rng = np.random.default_rng(1)
    plain = recorded(bench, rng)
    s = _made("sent on change", bench, 1).samples
    off = np.abs(s.acc - plain.acc).max() / 1e-2
    assert 0 < off <= 20
    assert off == pytest.approx(np.abs(s.gyr - plain.gyr).max() / 1e-3, rel=0.05)


@pytest.mark.thorough
def test_what_a_high_pass_leaves_at_last_is_nothing() -> None:
    """Whatever its constant: its sum over all times is that of nothing."""
    bench = _ideal("two")
    constants = []
    for seed in range(20):
        s, plain = _made("acc high-passed", bench, seed).samples, _samples(bench)
        here = s.within(0.0, 5.0)  # at rest
        left = np.linalg.norm(s.acc[here], axis=1) / np.linalg.norm(plain.acc[0])
        constants.append(-s.t[here][-1] / np.log(left[-1] / left[0]))
    assert min(constants) < 10 < 100 < max(constants) < 3001


def test_gyroscopes_zeroed_at_a_stop_show_nothing_of_their_bias() -> None:
    bench = _ideal("five", gyr_bias=np.array([0.01, -0.02, 0.03]))
    s = _made("gyr zeroed at each stop", bench).samples
    for _, end in bench.windows:
        assert np.abs(s.gyr[s.within(end - 5, end)]).max() < 1e-9
    assert np.abs(s.gyr).max() > 0.05


def test_a_slow_sensor_is_repeated_in_its_own_time() -> None:
    bench = _ideal("five", acc_noise=1e-3)
    s, plain = _made("sampled and held", bench, 2).samples, _samples(bench)
    assert len(s.t) == len(plain.t)
    for values in (s.acc, s.gyr):
        same = (np.diff(values, axis=0) == 0).all(axis=1).mean()
        assert same == 0 or 0.04 < same < 0.91


def test_packets_out_of_order_lose_no_sample() -> None:
    bench = _ideal("five", acc_noise=1e-3)
    for seed in range(2):
        rng = np.random.default_rng(seed)
        plain = recorded(bench, rng)
        s = _made("packets out of order", bench, seed).samples
        order = np.argsort(plain.acc[:, 0])
        assert s.acc[np.argsort(s.acc[:, 0])] == pytest.approx(plain.acc[order])
        assert np.sort(s.t) == pytest.approx(plain.t)


def test_an_hour_or_less_by_which_a_clock_is_set() -> None:
    bench = _ideal("two")
    for seed in range(12):
        steps = np.diff(_made("clock set", bench, seed).samples.t) - 0.01
        assert np.count_nonzero(np.abs(steps) > 1e-6) == 1
        size = np.abs(steps).max()
        assert 0.019 < size < 20.1 or size == pytest.approx(3600.0)


def test_significant_digits_keep_a_part_of_a_value() -> None:
    bench = _ideal("five", gyr_bias=np.array([0.01, -0.02, 0.03]))
    for seed in range(6):
        s, plain = _made("few significant digits", bench, seed).samples, _samples(bench)
        off = np.abs(s.acc - plain.acc)
        assert 0 < off.max() and (off < 5.1e-3 * np.abs(plain.acc) + 1e-7).all()


def test_a_log_that_is_stopped_at_each_turn_has_the_rests_alone() -> None:
    bench = _ideal("five")
    every, s = _samples(bench), _made("turns not recorded", bench).samples
    assert len(s.t) < len(every.t) and np.abs(s.gyr).max() < 1e-3
    assert _means(bench, s) == pytest.approx(_means(bench, every))
    assert np.count_nonzero(np.diff(s.t) > 1.0) == len(bench.windows) - 1


def test_a_direction_of_gravity_has_no_scale_factor_and_no_bias() -> None:
    bench = replace(_ideal("five"), acc_scale=np.array([1.01, 0.99, 1.02]))
    seen = _made("gravity's direction alone", bench).samples.acc
    assert np.linalg.norm(seen, axis=1) == pytest.approx(np.full(len(seen), 9.80665))
    before = _samples(bench).acc
    assert seen[0] / 9.80665 == pytest.approx(before[0] / np.linalg.norm(before[0]))


def test_a_device_that_calibrates_itself_is_at_last_what_it_was_drawn() -> None:
    bench = _ideal("five")
    before, after = _samples(bench), _made("calibrates itself", bench).samples
    first, last = bench.windows[0], bench.windows[-1]
    for name in ("acc", "gyr"):
        off = np.abs(getattr(after, name) - getattr(before, name)).max(axis=1)
        assert off[before.within(*first)].min() > 1e-5
        assert off[before.within(*last)].max() == 0.0


def test_a_device_askew_feels_the_same_force_in_other_axes() -> None:
    bench = _ideal("five")
    straight = _means(bench, _samples(bench))
    spoiled = spoilt(bench, ("fastened askew",), np.random.default_rng(5))
    askew = _means(bench, _samples(spoiled))
    sizes = np.linalg.norm(straight, axis=1)
    assert np.linalg.norm(askew, axis=1) == pytest.approx(sizes)
    turn, off = Rotation.align_vectors(askew, straight)
    assert np.deg2rad(0.1) < turn.magnitude() < np.deg2rad(2.0) and off < 1e-5


def test_angles_that_are_read_coarsely_are_off_by_half_a_step_at_most() -> None:
    bench = spoilt(_ideal("wide"), ("angles read coarsely",), np.random.default_rng(3))
    assert 0 < np.abs(np.rad2deg(bench.off)).max() <= 0.5


def test_a_second_device_sends_every_so_often_and_feels_the_same() -> None:
    """Without errors of their own, two at an angle differ by how they are turned."""
    bench = replace(_ideal("wide"), acc_noise=1e-9)
    plain = _samples(bench)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        heard = spoilt(bench, ("a second device heard",), rng)
        beside = heard.beside
        assert beside is not None
        ideal = replace(
            beside, device=IDEAL, acc_bias=NONE, acc_scale=np.ones(3), exchanged=0.0
        )
        s = _samples(replace(heard, beside=ideal))
        assert len(s.t) == pytest.approx(len(plain.t) * (1 + 1 / beside.every), abs=1)
        assert np.diff(s.t).min() > 0 or beside.every > 1
        other = ~np.isin(s.acc[:, 0], plain.acc[:, 0])
        place = np.flatnonzero(other)
        assert (np.diff(place) == beside.every + 1).all()
        start, end = bench.windows[1]
        here = s.within(start, end)
        first, second = (s.acc[here & of].mean(axis=0) for of in (~other, other))
        assert np.linalg.norm(second) == pytest.approx(np.linalg.norm(first), rel=1e-6)
        turn = Rotation.from_rotvec(beside.turned)
        assert 0.04 < np.rad2deg(turn.magnitude()) < 1.01
        assert second == pytest.approx(turn.inv().apply(first), abs=1e-6)


def test_a_second_device_is_heard_in_the_wrong_order_at_times() -> None:
    bench = _ideal("five", acc_bias=NONE + 1.0)
    beside = spoilt(bench, ("a second device heard",), np.random.default_rng(0)).beside
    assert beside is not None
    beside = replace(beside, acc_bias=NONE + 5.0, every=1, exchanged=0.2)
    s = _samples(replace(bench, beside=beside))
    second = (s.acc.sum(axis=1) > 0)[s.within(0.0, 30.0)]  # in the first position
    twice = np.count_nonzero(second[1:] & second[:-1]) / len(second)
    assert twice == pytest.approx(0.2 * 0.8 / 2, rel=0.25)


def test_a_table_in_steps_leaves_a_saw_that_ends_at_the_bias() -> None:
    bench = _ideal("five")
    jumps = []
    for seed in range(6):
        plain = recorded(bench, np.random.default_rng(seed))
        s = _made("corrected in steps", bench, seed).samples
        for seen, honest in ((s.acc, plain.acc), (s.gyr, plain.gyr)):
            more = seen - honest
            end = np.searchsorted(s.t, bench.windows[-1, 1])
            assert more[end] == pytest.approx(NONE, abs=1e-6)
            steps = np.diff(more, axis=0)
            large = np.abs(steps) > 20 * np.median(np.abs(steps), axis=0)
            assert 1 <= np.count_nonzero(large[:, 0]) <= 5
            assert (np.ptp(more, axis=0) < 1.01 * np.abs(steps).max(axis=0)).all()
        jumps.append(np.abs(np.diff(s.acc - plain.acc, axis=0)).max(axis=0) / 1e-3)
    assert np.array(jumps) == pytest.approx(np.round(jumps), abs=0.02)


def test_biases_that_shift_at_times_are_at_last_what_they_were_drawn() -> None:
    bench = replace(_ideal("five"), acc_noise=1e-3, gyr_noise=1e-4)
    plain = recorded(bench, np.random.default_rng(1))
    error = np.array([1e-3, 1e-4]) / np.sqrt(bench.hold * bench.rate)
    for seed in (1, 1):
        s = _made("biases shifted at times", bench, seed).samples
        more = (s.acc - plain.acc, s.gyr - plain.gyr)
        for seen, unit in zip(more, error, strict=True):
            steps = np.diff(seen, axis=0)
            there = np.abs(steps).max(axis=1) > 1e-9
            assert 2 <= np.count_nonzero(there) <= 4
            assert 0.5 < np.std(steps[there]) / unit < 60
            assert seen[s.within(*bench.windows[-1])] == pytest.approx(0.0, abs=1e-12)


def test_axes_of_a_screen_are_those_of_the_device_in_the_last_positions() -> None:
    bench = _ideal("six_faces")
    honest = _means(bench, _samples(bench))
    for seed in range(4):
        means = _means(bench, _made("axes of the screen", bench, seed).samples)
        other = np.abs(means - honest).max(axis=1) > 1e-9
        assert not other[3:].any()
        assert means[:, 2] == pytest.approx(honest[:, 2])
        assert abs(means[0] @ honest[0]) < 1e-9  # g along y becomes g along x


def test_smoothed_outputs_are_late_and_have_few_decimals() -> None:
    bench = replace(_ideal("five"), acc_noise=0.02, gyr_noise=1e-3)
    quieter, digits = [], set()
    for seed in range(8):
        plain = recorded(bench, np.random.default_rng(seed)).acc
        s = _made("smoothed", bench, seed).samples
        exact = [n for n in range(2, 7) if np.array_equal(s.acc, np.round(s.acc, n))]
        digits.add(exact[0])
        assert s.acc.mean() == pytest.approx(plain.mean(), abs=0.2)
        quieter.append(np.diff(s.acc, axis=0).std() / np.diff(plain, axis=0).std())
    assert max(quieter) < 0.5
    assert len(digits) > 2 and digits <= {2, 3, 4, 5, 6}
