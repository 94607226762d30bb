"""Whether a bump left the device as it lay: recordings drawn by their own physics."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Block, concat
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
