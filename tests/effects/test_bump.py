"""Bumps at the very ends of windows, and of a recording."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from fieldcal.core.samples import Block
from fieldcal.diagnosis.signal.chain import check_chain
from fieldcal.physics.recording import Rows
from fieldcal.session.description_file import parse_description

HZ, N, G = 50.0, 1000, 9.8


def touched(at: int, many: int = 8) -> tuple[NDArray[np.bool_], list[Rows]]:
    """What is usable, (n,), and the rows masked, of a recording touched from a row."""
    rng = np.random.default_rng(4)
    t = np.arange(N) / HZ
    acc = np.array([0.0, -G, 0.0]) + rng.normal(0, 0.01, (N, 3))
    acc[at : at + many, 0] += 0.4 * np.resize([1, -1], len(acc[at : at + many]))
    block = Block.of(t, acc, rng.normal(0, 1e-3, (N, 3)))
    windows = [{"start_s": 0.0, "end_s": 9.99}, {"start_s": 9.99, "end_s": 20.0}]
    held = [{"alpha_deg": 0.0, "beta_deg": 0.0, **w} for w in windows]
    site = {"gravity": G, "latitude_deg": 50.0}
    about = parse_description({"format": 1, "site": site, "position": held})
    checked = check_chain(block, about)
    rows = [fault.rows for name, fault in checked.faults if name == "bump"]
    usable: NDArray[np.bool_] = np.all(checked.usable, axis=1)
    return usable, rows


@pytest.mark.parametrize("at", [0, 3, 492, 500, 700, N - 8, N - 4])
def test_a_bump_is_masked_within_its_own_window(at: int) -> None:
    usable, rows = touched(at)
    (masked,) = rows
    bumped = np.arange(at, min(at + 8, N))
    first, last = (0, 500) if at < 500 else (500, N)
    assert set(bumped) <= set(masked) and first <= masked.min() <= masked.max() < last
    # a fifth of a second on either side goes with it
    assert masked.min() == max(at - 10, first)
    assert masked.max() == min(bumped[-1] + 10, last - 1)
    np.testing.assert_array_equal(np.flatnonzero(~usable), masked)


def test_single_wild_samples_are_replaced_and_are_no_bumps() -> None:
    rng = np.random.default_rng(6)
    t = np.arange(N) / 20
    acc = np.array([0.0, -G, 0.0]) + rng.normal(0, 0.01, (N, 3))
    wild = np.array([90, 300, 301 + 40, 700])
    acc[wild, 1] += [25.6, -25.6, 25.6, -12.8]
    acc[500:506, 2] += 0.3
    block = Block.of(t, acc, rng.normal(0, 1e-3, (N, 3)))
    held = [{"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": 0.0, "end_s": 50.0}]
    site = {"gravity": G, "latitude_deg": 50.0}
    checked = check_chain(
        block, parse_description({"format": 1, "site": site, "position": held})
    )
    named = [f for name, f in checked.faults if name == "bump" and f.values]
    assert [round(float(f.values["at_s"])) for f in named] == [25]
    decoded = [f.values for name, f in checked.faults if name == "decode_fault"]
    assert decoded == [{"channel": "ay", "kind": "wild"}]
    assert np.abs(checked.block.acc[wild, 1] + G).max() < 0.05
    assert (~checked.usable[:, 1]).sum() <= 6 + 8


def bumps_while_shaken(seed: int, push: float) -> list[float]:
    """When bumps are named, s, of a sensor that rectifies what shakes it.

    The second of two windows is shaken, so that the first tells what the noise is.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(2 * N) / 25
    shaken = 3.0 * rng.standard_normal(2 * N) * (t > 40)
    acc = np.array([0.0, -G, 0.0]) + rng.normal(0, 0.01, (2 * N, 3))
    acc[:, 1] += shaken + 0.18 * shaken**2
    acc[1600:1620, 1] += push
    block = Block.of(t, acc, rng.normal(0, 1e-3, (2 * N, 3)))
    windows = [{"start_s": 0.0, "end_s": 39.9}, {"start_s": 40.1, "end_s": 79.9}]
    held = [{"alpha_deg": 0.0, "beta_deg": 0.0, **w} for w in windows]
    site = {"gravity": G, "latitude_deg": 50.0}
    checked = check_chain(
        block, parse_description({"format": 1, "site": site, "position": held})
    )
    return [f.from_s for name, f in checked.faults if name == "bump" and f.values]


def test_the_long_tail_of_a_rectified_vibration_is_no_bump() -> None:
    said = [bumps_while_shaken(seed, push=0.0) for seed in range(8)]
    assert not any(said)
    for seed in range(2):
        (at,) = bumps_while_shaken(seed, push=60.0)
        assert abs(at - 64.0) < 0.5


def pushed(
    seed: int, lasts: float, shape: str, size: float
) -> list[tuple[float, float]]:
    """When bumps are said to be, s, in a window of some seconds, at 100 Hz.

    A push begins after three seconds of it: there and back within a second, a jump that
    lasts, or what fades from there; `size` in standard deviations of a sample.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(round((lasts + 30) * 100)) / 100
    acc = np.array([0.0, -G, 0.0]) + rng.normal(0, 0.04, (len(t), 3))
    since = t - 33.0
    push = {
        "there and back": np.sin(np.pi * since) * ((since > 0) & (since < 1)),
        "jump": (since > 0).astype(float),
    }
    acc[:, 1] += 0.04 * size * push[shape]
    block = Block.of(t, acc, rng.normal(0, 1e-3, (len(t), 3)))
    ends = ((0.0, 29.9), (30.1, 30 + lasts))
    held = [
        {"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": a, "end_s": b} for a, b in ends
    ]
    site = {"gravity": G, "latitude_deg": 50.0}
    checked = check_chain(
        block, parse_description({"format": 1, "site": site, "position": held})
    )
    return [(f.from_s, f.to_s) for name, f in checked.faults if name == "bump"]


@pytest.mark.parametrize("lasts", [6.0, 20.0, 300.0])
def test_a_push_of_a_second_is_found_however_long_the_window_is(lasts: float) -> None:
    """It bends the course of a short window, and is much of what is near it."""
    for seed in range(2 if lasts > 100 else 5):
        ((start, end),) = pushed(seed, lasts, "there and back", 3.5)
        assert 32.9 < start < 33.4 and 33.6 < end < 34.1


@pytest.mark.parametrize("lasts", [10.0, 40.0])
def test_a_jump_is_no_push(lasts: float) -> None:
    for seed in range(5):
        assert pushed(seed, lasts, "jump", 3.5) == []


def test_a_sway_that_turns_back_at_the_end_of_a_window_is_no_push() -> None:
    """Its course goes on neither as it was nor stays."""
    for phase in np.linspace(0, 2 * np.pi, 12):
        rng = np.random.default_rng(3)
        t = np.arange(1500) / 25
        rates = rng.normal(0, 1e-3, (len(t), 3))
        rates[:, 2] += 0.1 * np.sin(2 * np.pi * t / 9.0 + phase) * (t > 30)
        acc = np.array([0.0, -G, 0.0]) + rng.normal(0, 0.01, (len(t), 3))
        ends = ((0.0, 29.9), (30.1, 59.9))
        held = [
            {"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": a, "end_s": b}
            for a, b in ends
        ]
        site = {"gravity": G, "latitude_deg": 50.0}
        about = parse_description({"format": 1, "site": site, "position": held})
        checked = check_chain(Block.of(t, acc, rates), about)
        assert [f for name, f in checked.faults if name == "bump"] == []


def held_by_hand(seed: int, push: float) -> list[float]:
    """When bumps are said to be, s, in eight windows of 4 s that a hand held.

    In one or two of them it swings slowly. In the fourth a push of `push` standard
    deviations of a sample lasts from 17.5 to 18.5 s.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(8 * 5 * 50) / 50
    window = (t // 5).astype(int)
    rates = rng.normal(0, 1e-3, (len(t), 3))
    for w in range(8):
        hz = rng.uniform(0.35, 0.9) if rng.random() < 0.2 and w != 3 else 6.0
        swing = 2e-3 * np.sin(2 * np.pi * hz * t + rng.uniform(0, 6.28))
        rates[:, w % 3] += swing * (window == w)
    rates[:, 1] += 1e-3 * push * np.sin(np.pi * (t - 17.5)) * (abs(t - 18) < 0.5)
    acc = np.array([0.0, -G, 0.0]) + rng.normal(0, 0.01, (len(t), 3))
    held = [
        {"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": 5.0 * w, "end_s": 5.0 * w + 4}
        for w in range(8)
    ]
    site = {"gravity": G, "latitude_deg": 50.0}
    about = parse_description({"format": 1, "site": site, "position": held})
    checked = check_chain(Block.of(t, acc, rates), about)
    return [f.from_s for name, f in checked.faults if name == "bump"]


def test_a_hand_that_swings_slowly_in_some_windows_is_not_pushed() -> None:
    """A half period of it is as a push, but so are those before and after."""
    false = [at for seed in range(8) for at in held_by_hand(seed, 0.0)]
    assert len(false) <= 1
    pushed = [held_by_hand(seed, 3.5) for seed in range(5)]
    assert sum(any(17 < at < 18.5 for at in found) for found in pushed) >= 4


@pytest.mark.parametrize("value", [0.0, 1.0, np.nan])
def test_a_channel_that_says_nothing_is_not_pushed(value: float) -> None:
    """It never changes, or nobody sent it; beside it a push is found."""
    rng = np.random.default_rng(9)
    t = np.arange(N) / HZ
    six = np.array([0.0, -G, 0.0, 0.0, 0.0, 0.0]) + rng.normal(0, 1e-3, (N, 6))
    six[:, 4] = value
    six[100:700, 2] = np.nan
    six[400:430, 3] += 5e-3
    held = [{"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": 0.0, "end_s": 20.0}]
    about = parse_description({"format": 1, "site": {"gravity": G}, "position": held})
    checked = check_chain(Block.of(t, six[:, :3], six[:, 3:]), about)
    (found,) = [fault for name, fault in checked.faults if name == "bump"]
    assert found.channel == "gx" and abs(found.from_s - 8.0) < 0.1


@given(
    seed=st.integers(0, 10**6),
    hz=st.sampled_from([4.0, 10.0, 50.0, 400.0]),
    many=st.integers(8, 400),
    pushes=st.integers(0, 4),
    step=st.sampled_from([0.0, 0.05]),
    missing=st.sampled_from([0.0, 0.1]),
    silent=st.sampled_from([None, 0.0, 1.0, np.nan]),
)
@settings(max_examples=15, deadline=None, derandomize=True)
def test_however_short_a_window_is_and_whatever_is_in_it_nothing_breaks(
    seed: int,
    hz: float,
    many: int,
    pushes: int,
    step: float,
    missing: float,
    silent: float | None,
) -> None:
    """Pushes of any length and size, coarse steps, gaps; warnings are errors."""
    rng = np.random.default_rng(seed)
    t = np.arange(2 * many) / hz
    six = [0.0, -G, 0.0, 0.0, 0.0, 0.0] + 0.01 * rng.standard_normal((2 * many, 6))
    for _ in range(pushes):
        first = int(rng.integers(0, 2 * many))
        last = first + int(rng.integers(1, max(many // 2, 2)))
        six[first:last, rng.integers(0, 6)] += 10 ** rng.uniform(-2, 2)
    if step:
        six = step * np.round(six / step)
    if silent is not None:
        six[:, rng.integers(0, 6)] = silent
    six[rng.random(six.shape) < missing] = np.nan
    ends = (t[0], t[many - 1]), (t[many], t[-1])
    held = [
        {"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": float(a), "end_s": float(b)}
        for a, b in ends
    ]
    about = parse_description({"format": 1, "site": {"gravity": G}, "position": held})
    checked = check_chain(Block.of(t, six[:, :3], six[:, 3:]), about)
    assert checked.usable.shape == six.shape
    for fault in checked.faults:
        assert t[0] <= fault[1].from_s <= fault[1].to_s <= t[-1] + 2 / hz
