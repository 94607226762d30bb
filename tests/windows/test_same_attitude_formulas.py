"""Formulas of `same_attitude`, each by other means than its own."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal

from fieldcal.core.samples import Array, Block
from fieldcal.windows import joined_rests, same_attitude
from fieldcal.windows.cells import CellAccumulator, CellTable
from fieldcal.windows.quiet import estimate_quiet_noise
from fieldcal.windows.same_attitude import probability_unmoved
from fieldcal.windows.stretches import cell_rows

FORCE = np.array([2.0, -5.0, 8.0])
SPREAD = np.array([1e-3, 2e-3, 3e-3]) ** 2
UNSURE = np.array([3e-4, 2e-4, 4e-4]) ** 2
NOTHING = np.full(3, np.nan)
STILL = (np.zeros(3), UNSURE, 0.0)
NO_CELLS = CellTable(np.zeros(0), np.zeros((0, 34)), np.zeros(6))
WAY = Block.of(np.arange(20) / 50, FORCE + np.zeros((20, 3)))


class Unmoved:
    """The probability, where what is measured is given."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.patch = patch

    def __call__(
        self,
        change: Array,
        turn: tuple[Array, Array, float] = STILL,
        spread: Array = SPREAD,
        way: Block = WAY,
    ) -> float:
        rates = np.full(3, 7.0)  # read by `_turn_in_gap` alone
        means = tuple(np.append(part, rates) for part in (FORCE, change, spread))

        def compared(before: CellTable, after: CellTable, gap: float) -> object:
            assert gap == 1.0
            return means

        self.patch.setattr(same_attitude, "_compare_means", compared)
        self.patch.setattr(same_attitude, "_turn_in_gap", lambda *_: turn)
        return probability_unmoved(NO_CELLS, way, NO_CELLS, (-0.25, 0.75))


@pytest.fixture
def unmoved(monkeypatch: pytest.MonkeyPatch) -> Unmoved:
    return Unmoved(monkeypatch)


def by_bayes(change: Array, turned: Array, spread: Array, unsure: Array) -> float:
    """Sum over the four cases; outputs with nan are left out."""
    measured, variance = np.append(change, turned), np.append(spread, unsure)
    some = np.isfinite(measured)
    chances = []
    for turns in (False, True):
        chance = 0.0
        for jumps in (False, True):
            cov = np.diag(np.where(some, variance, 1.0))
            if turns:
                for axis in np.eye(3):
                    one = 5e-3 * np.append(np.cross(FORCE, axis), axis)
                    cov += np.outer(one, one)
            if jumps:
                cov[[0, 1, 2], [0, 1, 2]] += 0.05**2
            density = multivariate_normal(cov=cov[np.ix_(some, some)])
            chance += (0.01 if jumps else 0.99) * density.pdf(measured[some])
        chances.append(chance)
    return float(chances[0] / sum(chances))


@pytest.mark.parametrize(
    ("change", "turned"),
    [
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([4e-3, 1e-3, -2e-3], [6e-4, -3e-4, 0.0]),
        ([0.05, -0.03, 0.02], [1e-4, 2e-4, 0.0]),  # a jump, or nothing
        ([0.05, 0.02, 0.0], [4e-4, -2e-4, 1e-3]),
        ([-0.012, 6e-3, 5e-3], [0.0, -1e-3, 0.0]),
        ([-1e-3, 8e-4, 5e-4], NOTHING),  # the force alone
        ([-5e-3, 3e-3, 2e-3], NOTHING),
        (NOTHING, [6e-4, -3e-4, 8e-4]),  # the gyroscopes alone
    ],
)
def test_the_probability_is_that_of_four_cases(
    unmoved: Unmoved, change: list[float], turned: list[float]
) -> None:
    d, phi = np.array(change), np.array(turned)
    unsure = np.where(np.isfinite(phi), UNSURE, np.nan)
    most = float(np.linalg.norm(phi))
    expected = by_bayes(d, phi, SPREAD, UNSURE)
    assert 1e-4 < expected < 1
    found = unmoved(d, (phi, unsure, most))
    assert found / (1 - found) == pytest.approx(expected / (1 - expected), rel=1e-6)


def test_one_axis_by_hand(unmoved: Unmoved) -> None:
    """A gyroscope's angle alone: the ratio of two normal densities, by quadrature."""
    phi, sigma = 1.2e-3, 3e-4
    turn = (np.array([phi, 0.0, 0.0]), np.array([sigma**2, 1e8, 1e8]), phi)

    def density(theta: float) -> float:
        return float(np.exp(-(((phi - theta) / sigma) ** 2 + (theta / 5e-3) ** 2) / 2))

    moved = quad(density, -0.02, 0.02, points=[phi])[0] / 5e-3 / np.sqrt(2 * np.pi)
    odds = np.exp(-((phi / sigma) ** 2) / 2) / moved
    found = unmoved(NOTHING, turn)
    assert found / (1 - found) == pytest.approx(odds, rel=1e-6)


def test_an_accelerometer_that_is_missing_takes_the_others_with_it(
    unmoved: Unmoved,
) -> None:
    """The cross product needs all three; a gyroscope is one by itself."""
    phi = np.array([6e-4, -3e-4, 8e-4])
    expected = by_bayes(NOTHING, phi, SPREAD, UNSURE)
    some = np.array([0.0, np.nan, 0.0])
    assert unmoved(some, (phi, UNSURE, 0.0)) == pytest.approx(expected)
    frozen = np.array([0.0, *SPREAD[1:]])  # no noise, and so no weight
    assert unmoved(np.zeros(3), (phi, UNSURE, 0.0), frozen) == pytest.approx(expected)
    two = np.array([np.nan, -3e-4, 8e-4])
    with_force = by_bayes(np.zeros(3), two, SPREAD, UNSURE)
    assert unmoved(np.zeros(3), (two, UNSURE, 0.0)) == pytest.approx(with_force)
    unsure = np.array([np.nan, *UNSURE[1:]])
    assert unmoved(np.zeros(3), (two, unsure, 0.0)) == pytest.approx(with_force)
    assert unmoved(some, (two, UNSURE, 0.0)) == 0.0, "nothing tells a turn about x"


def test_more_than_a_tenth_of_a_radian_is_elsewhere(unmoved: Unmoved) -> None:
    """By the gyroscopes on the way, or by the force from before to after."""
    size, wide = float(np.linalg.norm(FORCE)), np.full(3, 4.0)
    along = FORCE / size
    for angle, there in ((0.095, True), (0.105, False)):
        assert (unmoved(np.zeros(3), (np.zeros(3), UNSURE, angle)) > 0) == there
        assert (unmoved(angle * size * along, STILL, wide) > 0) == there
        away = Block.of(WAY.t, WAY.acc + angle * size * along)
        nobody = (NOTHING, NOTHING, np.nan)
        assert (unmoved(np.zeros(3), nobody, wide, away) > 0) == there
        # gyroscopes that work say so themselves
        assert unmoved(np.zeros(3), STILL, wide, away) > 0
    assert unmoved(NOTHING, (NOTHING, NOTHING, np.nan), SPREAD, WAY[:0]) == 0.0


def cells(means: Array, origin: Array, times: Array, step: float = 1e-6) -> CellTable:
    """Cells of ten samples each; `means` (m, 6) less the origin."""
    sums = np.zeros((len(means), 34))
    sums[:, :6], sums[:, 18:24] = 10.0, 9.0
    sums[:, 6:12] = 10.0 * means
    sums[:, 12:18] = 9.0 * 2 * 1e-4**2  # noise of samples: 1e-4
    sums[:, 26:32] = step
    return CellTable(times, sums, origin)


@pytest.mark.parametrize(
    ("left", "right", "levels", "drift", "walk", "steps"),
    [
        (90, 70, 8, 0.0, 0.2, (0.0, 0.0)),
        (70, 90, 8, 2e-4, 0.2, (0.02, 0.01)),
        (40, 1300, 8, 1e-3, 0.2, (0.01, 0.02)),
        (1300, 40, 8, 0.0, 0.0, (0.0, 0.0)),
        (2400, 2400, 8, 1e-5, 0.0, (0.0, 0.03)),
        (4100, 4100, 10, 0.0, 0.0, (0.0, 0.0)),
    ],
)
def test_means_are_compared_over_the_best_time(
    left: int,
    right: int,
    levels: int,
    drift: float,
    walk: float,
    steps: tuple[float, float],
) -> None:
    """One after another, of lines by least squares."""
    rng, gap, origin = np.random.default_rng(left), 1.7, np.arange(6.0)
    times = np.r_[np.arange(left) * 0.1, gap + np.arange(left, left + right) * 0.1]
    sizes = np.geomspace(1e-3, 1e-2, 6)
    y = sizes * rng.standard_normal((left + right, 6)) + drift * times[:, None]
    y += walk * sizes * np.cumsum(rng.standard_normal(y.shape), axis=0)
    before = cells(y[:left], origin, times[:left], steps[0])
    after = cells(y[left:], origin, times[left:], steps[1])
    allan = estimate_quiet_noise(y, levels=levels).allan
    least = np.full(6, np.inf)
    level, change = np.zeros(6), np.zeros(6)
    for k in range(len(allan)):
        n = 2**k
        if n > min(left, right):
            break
        parts = [(times[:left][-4 * n :], y[:left][-4 * n :]),
                 (times[left:][: 4 * n], y[left:][: 4 * n])]  # fmt: skip
        slope = np.mean(
            [np.polyfit(t - t[0], p, 1)[0] if len(t) > 1 else 0 for t, p in parts],
            axis=0,
        )
        r = 1 + gap / (0.1 * n)
        b = (r + 1) ** 2 * np.log(r + 1) + (r - 1) ** 2 * np.log(r - 1)
        b = (b - 2 * r**2 * np.log(r)) / np.log(16)
        variance = 2 * b * allan[k] ** 2 + (slope * (gap + 0.1 * n)) ** 2
        one, other = y[left - n : left].mean(axis=0), y[left : left + n].mean(axis=0)
        better = variance < least
        least = np.where(better, variance, least)
        level = np.where(better, origin + (one + other) / 2, level)
        change = np.where(better, other - one, change)
    found = same_attitude._compare_means(before, after, gap)
    np.testing.assert_allclose(found[0], level)
    np.testing.assert_allclose(found[1], change)
    np.testing.assert_allclose(found[2], least + max(steps) ** 2 / 6)


def test_the_largest_angle_of_the_force_is_that_of_a_tenth_of_a_second() -> None:
    """A sample alone may be a knock; a tenth of a second of them is a turn."""
    up = np.array([0.0, 0.0, 10.0])
    acc = np.tile(up, (51, 1))
    acc[20:25, 0], acc[33, 1] = 0.5, -2.0
    acc[50, 1] = np.nan
    block = Block.of(np.arange(51) / 50, acc)
    assert same_attitude._largest_angle(block, up) == pytest.approx(0.05)
    acc[33, 1] = -4.0
    assert same_attitude._largest_angle(block, up) == pytest.approx(0.08)
    one = Block.of(np.zeros(1), up + np.array([[0.3, 0.4, 0.0]]))
    assert same_attitude._largest_angle(one, up) == pytest.approx(0.05)
    rare = Block.of(np.arange(4.0), up + np.diag([0.1, 0.2, 0.3, 0.4])[:, :3])
    assert same_attitude._largest_angle(rare, up) == pytest.approx(0.03)
    assert np.isnan(same_attitude._largest_angle(block[50:], up))


@pytest.mark.parametrize("count", [2, 3, 4, 5, 40])
def test_a_turn_in_a_gap_is_as_uncertain_as_its_samples_and_both_sides(
    count: int,
) -> None:
    """(4) sample by sample, of as high differences as there are."""
    rng, dt = np.random.default_rng(count), 0.02
    t, level = 7.0 + dt * np.arange(count), np.array([0.1, -0.2, 0.3])
    gyr = level + rng.normal(0.0, 0.01, (count, 3)) + [0.5, 0.0, -0.2]
    change, spread = np.array([3e-3, 1e-3, 2e-3]), np.array([4e-6, 1e-6, 9e-6])
    way = Block.of(t, np.zeros((count, 3)), gyr)
    angle, variance, most = same_attitude._turn_in_gap(way, level, change, spread)
    off = gyr - level
    sums = np.vstack([np.zeros(3), np.cumsum((off[1:] + off[:-1]) / 2 * dt, axis=0)])
    np.testing.assert_allclose(angle, sums[-1], atol=1e-4)
    assert most == pytest.approx(np.linalg.norm(sums, axis=1).max(), abs=1e-4)
    k = min(4, count - 1)
    weights = [(-1) ** j * comb(k, j) for j in range(k + 1)]
    fast = [
        np.dot(weights, off[i : i + k + 1]) ** 2 / sum(w**2 for w in weights)
        for i in range(count - k)
    ]
    expected = count * dt**2 * np.mean(fast, axis=0) + (most**2 / 2) ** 2
    expected += (t[-1] - t[0]) ** 2 * (spread / 4 + change**2 / 12)
    np.testing.assert_allclose(variance, expected)


def test_samples_beside_a_jump_agree_with_either_side_within_their_steps() -> None:
    """Coarse ones too: a step is their noise. A sample amid is from a touch."""
    rng = np.random.default_rng(3)
    for step, push, untouched in (
        (1e-6, 0.0, True), (1e-6, 0.05, False), (0.02, 0.05, True), (0.02, 0.4, False),
    ):  # fmt: skip
        means = 1e-4 * rng.standard_normal((20, 6))
        before = cells(means, np.zeros(6), 0.1 * np.arange(20), step)
        after = cells(means + 0.01, np.zeros(6), 3 + 0.1 * np.arange(20), step)
        six = np.zeros((30, 6))
        six[17:] = 0.01
        six += 1e-4 * rng.standard_normal(six.shape)
        six[11, :3] += push
        way = Block.of(2.0 + 0.02 * np.arange(30), six[:, :3], six[:, 3:])
        assert joined_rests._is_untouched(before, way, after) == untouched


def test_the_way_from_rest_to_rest_is_all_of_it_and_a_cell_on_either_side(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And of both rests as many cells as tell their noise, none of them cut."""
    monkeypatch.setattr(joined_rests, "NOISE_CELLS", 500)
    t = 0.02 * np.arange(6000)
    block = Block.of(t, FORCE + np.zeros((6000, 3)), np.zeros((6000, 3)))
    sums = CellAccumulator()
    sums.add(block)
    rows, origin = cell_rows(sums.table), sums.table.origin
    asked: list[tuple[Array, ...]] = []

    def unmoved(
        before: CellTable, way: Block, after: CellTable, gap: tuple[float, float]
    ) -> float:
        asked.append((before.times, way.t, after.times, np.array(gap)))
        return 1.0

    def between(start: float, end: float) -> list[Block]:
        return [block.between(start, end)]

    monkeypatch.setattr(joined_rests, "probability_unmoved", unmoved)
    monkeypatch.setattr(joined_rests, "_is_untouched", lambda *_: False)
    gaps = joined_rests._gaps_to_leave_out(
        rows, origin, between, (3.0, 50.005), (51.505, 117.0)
    )
    ((early, way, later, gap),) = asked
    assert gaps == [(50.005, 51.505)] and gap.tolist() == [50.005, 51.505]
    assert way[0] == pytest.approx(49.92) and way[-1] == pytest.approx(51.6)
    assert len(early) == 470 and early[-1] == pytest.approx(49.9, abs=0.03)
    assert len(later) == 500 and later[0] == pytest.approx(51.6, abs=0.03)
