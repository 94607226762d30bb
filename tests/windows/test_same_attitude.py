"""Whether a bump left the device as it lay: recordings drawn by their own physics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array, Block, concat
from fieldcal.windows import same_attitude
from fieldcal.windows.cells import CELL, CellAccumulator, CellTable
from fieldcal.windows.joined_rests import LEAST_PROBABILITY, RestPeriod, join_rests
from fieldcal.windows.same_attitude import (
    TYPICAL_ROTATION,
    flicker_bias_function,
    probability_unmoved,
)
from fieldcal.windows.stretches import cell_rows, still_stretches

RATE, G = 50.0, 9.81
AT = (40.0, 75.0)
"""When a table is knocked, s."""


def recorded(
    seed: int,
    tilts: float = 0.0,
    jump: float = 0.0,
    drift: float = 0.0,
    away: float = 0.0,
    swings: float = 2e-3,
    noise: float = 0.01,
    seconds: float = 120.0,
) -> Block:
    """Some time on a table that is knocked, with gyroscopes that give mean rates.

    Parameters
    ----------
    tilts : angle that the first knock turns the device by for good, deg
    jump : of the bias of ax at the first knock, m/s^2
    drift : of the bias of az, m/s^2/s
    away : angle by which it is lifted off for two seconds at the first, rad
    swings : angle that a knock lets it swing by, rad
    noise : of the accelerometers, m/s^2
    seconds : how long it is recorded

    """
    rng = np.random.default_rng(seed)
    edges = np.arange(round(seconds * RATE) + 1) / RATE
    t = edges[1:]
    axis, up = rng.normal(size=3), np.array([1.0, 5.0, 8.0]) + rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    up *= G / np.linalg.norm(up)
    axis -= up * (axis @ up) / G**2
    angle = np.zeros((len(edges), 3))
    acc = np.zeros((len(t), 3))
    for at in AT:
        s = np.maximum(edges - at, 0.0)[:, None]
        swing = swings * rng.normal(size=3) * np.sin(2 * np.pi * 9 * s)
        angle += swing * np.exp(-s / 0.2)
        ring = rng.normal(size=3) * np.sin(2 * np.pi * 31 * s[1:])
        acc += ring * np.exp(-s[1:] / 0.2)
    s = np.maximum(edges - AT[0], 0.0)[:, None]
    angle += np.deg2rad(tilts) * axis / np.linalg.norm(axis) * (1 - np.exp(-s / 0.1))
    angle += away * np.array([1.0, 0, 0]) * np.sin(np.pi * np.minimum(s, 2.0) / 2) ** 2
    acc += up + np.cross(up, angle[1:]) + noise * rng.standard_normal((len(t), 3))
    acc[:, 0] += jump * (t > AT[0])
    acc[:, 2] += drift * t
    gyr = np.diff(angle, axis=0) * RATE + 5e-4 * rng.standard_normal((len(t), 3))
    return Block.of(t, acc, gyr + 0.01)


def rests(block: Block) -> list[RestPeriod]:
    cells = CellAccumulator()
    cells.add(block)
    table = cells.table
    return join_rests(
        cell_rows(table),
        table.origin,
        lambda start, end: [block.between(start, end)],
        still_stretches(block),
    )


def test_a_knock_is_left_out_of_a_rest() -> None:
    block = recorded(1)
    assert len(still_stretches(block)) == 3
    (rest,) = rests(block)
    assert len(rest.gaps) == 2
    for at, (start, end) in zip(AT, rest.gaps, strict=True):
        assert at - 1.0 <= start <= at and at + 0.2 <= end <= at + 2.0
    assert rest.pieces[1] == (rest.gaps[0][1], rest.gaps[1][0])


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("seeds", "other"), [(5, 0), pytest.param(12, 1, marks=pytest.mark.thorough)]
)
@pytest.mark.parametrize(
    ("facts", "least", "most"),
    [
        ({}, 1, 1),
        # it lies otherwise
        pytest.param({"tilts": 0.1}, 2, 2, marks=pytest.mark.thorough),
        ({"tilts": 0.03}, 2, 2),
        ({"jump": 0.03, "swings": 1e-4}, 1, 1),  # the gyroscopes saw no turn
        ({"drift": 2e-4}, 1, 1),  # a bias that goes on as it went
        ({"away": 0.3}, 2, 2),  # somebody lifted it
    ],
)
def test_it_lies_as_before_where_it_does(
    facts: dict[str, float], least: int, most: int, seeds: int, other: int
) -> None:
    """Of five recordings all, and of twelve all but one."""
    found = [len(rests(recorded(seed, **facts))) for seed in range(seeds)]
    inside = [least <= n <= most for n in found]
    assert sum(inside) >= len(inside) - other, found


def test_a_jump_is_no_jump_of_the_bias_without_gyroscopes() -> None:
    for seed in range(2):
        block = recorded(seed, jump=0.03)
        alone = Block.of(block.t, block.acc)
        assert len(rests(alone)) == 2
        calm = recorded(seed)
        assert len(rests(Block.of(calm.t, calm.acc))) == 1


@pytest.mark.parametrize("touched", [False, True])
def test_of_a_bias_that_jumps_untouched_nothing_is_left_out(touched: bool) -> None:
    """A jump of a gyroscope's bias is cut at, and joined again where it jumped."""
    rng, at = np.random.default_rng(8), 61.3
    t = np.arange(round(120 * RATE)) / RATE
    acc = [1.0, -5.0, 8.3] + 0.01 * rng.standard_normal((len(t), 3))
    gyr = 0.01 + 5e-4 * rng.standard_normal((len(t), 3))
    gyr[t > at, 1] += 4e-3
    if touched:
        s = np.maximum(t - at, 0.0)
        acc[:, 2] += 0.3 * np.sin(2 * np.pi * 11 * s) * np.exp(-s / 0.2)
    block = Block.of(t, acc, gyr)
    assert len(still_stretches(block)) == 2
    (rest,) = rests(block)
    assert len(rest.gaps) == touched
    assert rest.start < 2 and rest.end > 118


def test_positions_without_the_turns_between_them_are_not_one() -> None:
    """Rows that are taken at rest only: the gyroscopes show no turn."""
    t = np.arange(4000) / RATE
    for seed in range(4):
        rng = np.random.default_rng(seed)
        force = np.array([[0, 0, G], [0, G, 0], [G, 0, 0], [0, 0, -G]])
        acc = force[np.arange(4000) // 1000] + 0.01 * rng.standard_normal((4000, 3))
        block = Block.of(t, acc, 1e-3 * rng.standard_normal((4000, 3)))
        assert len(rests(block)) == 4, seed


def test_a_cone_that_ends_where_it_began_is_no_turn() -> None:
    """The integral of its rates is the area that it encloses, and no angle."""
    rng, size, at = np.random.default_rng(4), 0.04, (40.0, 42.0)
    fine = np.arange(round(80 * RATE) * 8 + 1) / RATE / 8
    part = np.clip((fine - at[0]) / (at[1] - at[0]), 0.0, 1.0)
    around = np.column_stack(
        [np.sin(2 * np.pi * part), 1 - np.cos(2 * np.pi * part), 0 * part]
    )
    held = Rotation.from_rotvec(size * around)
    rate = (held[:-1].inv() * held[1:]).as_rotvec() * RATE * 8
    gyr = rate.reshape(-1, 8, 3).mean(axis=1)
    assert np.abs(gyr.sum(axis=0) / RATE).max() > 4e-3
    t, noise = fine[8::8], rng.standard_normal((2, len(fine) // 8, 3))
    acc = held[8::8].inv().apply([0.0, 1.0, 9.7]) + 0.01 * noise[0]
    block = Block.of(t, acc, gyr + 0.01 + 1e-4 * noise[1])
    gap = (39.5, 42.5)
    sides = [block.between(30.0, gap[0]), block.between(gap[1], 52.0)]
    way = block.between(gap[0] - CELL, gap[1] + CELL)
    before, after = cells_of(sides)
    assert probability_unmoved(before, way, after, gap) > LEAST_PROBABILITY


def test_what_went_on_in_a_pause_nobody_knows() -> None:
    block = recorded(1)
    some = [block.between(0, 40.2), block.between(43.2, 200)]
    assert len(rests(concat(some))) == 2


@pytest.mark.statistical
def test_what_is_said_to_be_sure_is() -> None:
    """Of knocks half of which turn the device by as much as is expected of them."""
    rng = np.random.default_rng(5)
    said, true = [], []
    for seed in range(120):
        as_it_lay = bool(rng.integers(2))
        turned = (
            0.0 if as_it_lay else float(np.rad2deg(TYPICAL_ROTATION) * rng.rayleigh())
        )
        block = recorded(seed, turned, noise=0.1, seconds=52.0)
        gap = (39.5, 42.0)
        sides = [block.between(30.0, gap[0]), block.between(gap[1], 51.0)]
        before, after = cells_of(sides)
        way = block.between(gap[0] - CELL, gap[1] + CELL)
        said.append(probability_unmoved(before, way, after, gap) > LEAST_PROBABILITY)
        true.append(as_it_lay)
    sure, same = np.array(said), np.array(true)
    assert sure[same].mean() > 0.8
    assert (~same[sure]).mean() < 0.05


def cells_of(sides: list[Block]) -> list[CellTable]:
    """Cells of two parts of a recording, about one origin."""
    cells = CellAccumulator()
    cells.add(concat(sides))
    table = cells.table
    first = table.times < sides[1].t[0] - CELL / 2
    return [
        CellTable(table.times[some], table.sums[some], table.origin)
        for some in (first, ~first)
    ]


@pytest.mark.parametrize("r", [1.0001, 1.5, 2.0, 6.0])
def test_the_bias_function_is_that_of_the_spectrum(r: float) -> None:
    """Power 1/f through the difference of two means over one second, r s apart."""
    f = np.geomspace(1e-6, 3e3, 400_001)
    over_one = np.sinc(f) ** 2 / f
    power = [trapezoid(over_one * np.sin(np.pi * f * d) ** 2, f) for d in (r, 1.0)]
    assert flicker_bias_function(r) == pytest.approx(power[0] / power[1], rel=1e-3)


def test_a_slope_does_not_depend_on_the_level() -> None:
    t = CELL * np.arange(40)
    means = np.outer(t, np.arange(6.0)) + np.linspace(-9.0, 9.0, 6)
    np.testing.assert_allclose(same_attitude._slope(means), np.arange(6.0), atol=1e-9)


def turned_in_gap(
    gyr: Array, level: Array, change: Array, spread: Array
) -> tuple[Array, Array, float]:
    """Rotation by rates (n, 3) at 50 Hz, its variance, and the largest on the way."""
    t = np.arange(len(gyr)) / RATE
    return same_attitude._turn_in_gap(Block.of(t, 0 * gyr, gyr), level, change, spread)


def test_the_turn_in_a_gap_is_the_integral_of_the_rates() -> None:
    """Of a rate that rises and falls by parabolas, beside a level."""
    t, level, none = np.arange(101) / RATE, np.array([0.01, -0.02, 0.0]), np.zeros(3)
    gyr = level + np.outer(t * (2.0 - t), [0.03, 0.0, -0.04])
    turned, _, most = turned_in_gap(gyr, level, none, none)
    np.testing.assert_allclose(turned, [0.04, 0.0, -0.16 / 3], rtol=2e-4, atol=1e-12)
    assert most == pytest.approx(0.2 / 3, rel=2e-4)
    gyr = level + np.outer(np.linspace(0.0, 0.06, 101), [1.0, 0.0, 0.0])
    turned, _, most = turned_in_gap(gyr, level, none, none)  # whichever end it grows to
    np.testing.assert_allclose([turned[0], most], 0.06, rtol=1e-9)


def test_the_turn_in_a_gap_is_as_uncertain_as_what_it_is_made_of() -> None:
    """The level beside the gap, a jump of it within, white noise, and finite angles."""
    none, still = np.zeros(3), np.zeros((101, 3))
    # both sides are off by 1 and 3 mrad/s: their mean by half the root of the squares
    side = np.array([1e-3, 3e-3])
    _, variance, _ = turned_in_gap(still, none, none, np.full(3, side @ side))
    np.testing.assert_allclose(variance, (2.0 * np.hypot(*side) / 2) ** 2)
    # a jump at any instant of two seconds, where half of it is taken off
    jump, at = 4e-3, (np.arange(1000) + 0.5) / 500
    missed = jump * (2.0 - at) - jump * 1.0
    _, variance, _ = turned_in_gap(still, none, np.full(3, jump), none)
    np.testing.assert_allclose(variance, (missed**2).mean(), rtol=1e-5)
    noise = 2e-3 * np.random.default_rng(6).standard_normal((20_001, 3))
    _, variance, most = turned_in_gap(noise, none, none, none)
    white = 20_001 * (2e-3 / RATE) ** 2
    np.testing.assert_allclose(variance - (most**2 / 2) ** 2, white, rtol=0.06)
    # two turns by 0.08 rad about axes across each other differ by half a product in
    # the two orders
    one, other = (Rotation.from_rotvec(0.08 * axis) for axis in np.eye(3)[:2])
    apart = (one * other).as_rotvec() - [0.08, 0.08, 0.0]
    _, variance, _ = turned_in_gap(still + [0.04, 0.0, 0.0], none, none, none)
    np.testing.assert_allclose(np.sqrt(variance), np.linalg.norm(apart), rtol=0.03)


@pytest.mark.statistical
@pytest.mark.parametrize("gap", [0, 16, 48])
def test_means_of_flicker_apart_differ_as_the_bias_function_says(gap: int) -> None:
    rng = np.random.default_rng(gap)
    n, m = 1 << 14, 16
    f = np.fft.rfftfreq(n)
    f[0] = np.inf
    changes = []
    for _ in range(60):
        y = np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) / np.sqrt(f), n)
        means = np.convolve(y, np.ones(m) / m, "valid")
        changes.append(
            [
                (np.diff(means[:: m + apart]) ** 2).mean()
                if apart == 0
                else ((means[m + apart :] - means[: -m - apart]) ** 2).mean()
                for apart in (0, gap)
            ]
        )
    near, far = np.mean(changes, axis=0)
    assert far / near == pytest.approx(flicker_bias_function(1 + gap / m), rel=0.05)
