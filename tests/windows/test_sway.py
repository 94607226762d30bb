"""Windows on a base that sways, against attitudes made another way."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array, Block
from fieldcal.windows import Stillness, sway
from fieldcal.windows.sway import find_sway
from fieldcal.windows.sway_process import needed_seconds
from fieldcal.windows.sway_waves import SwayWaves

G, RATE = 9.81, 50.0
NOISE = np.repeat([5e-3, 1e-3], 3)
REST = np.array([0.05, -G - 0.03, 0.02, 2e-3, -1e-3, 3e-3])


def swayed(
    rng: np.random.Generator,
    hz: tuple[float, ...],
    degrees: float = 1.0,
    seconds: float = 30.0,
    arm: Array | None = None,
) -> tuple[Array, Array]:
    """Times and outputs of a base that turns about both level axes.

    Force and rate follow from the attitude by differences, and no formula.
    """
    fine = 8
    step = 1 / RATE / fine
    t = np.arange(-2 * fine, round(seconds * RATE) * fine + 2 * fine) * step
    level = np.zeros((len(t), 3))
    for one in hz:
        for axis in (0, 2):
            phase = rng.uniform(0, 2 * np.pi)
            size = np.deg2rad(degrees) / np.sqrt(2 * len(hz))
            level[:, axis] += size * np.sin(2 * np.pi * one * t + phase)
    held = Rotation.from_rotvec(level)
    body = held.inv()
    place = np.zeros_like(level) if arm is None else held.apply(arm)
    pushed = np.gradient(np.gradient(place, t, axis=0), t, axis=0)
    acc = body.apply(pushed + [0.0, -G, 0.0])
    gyr = (held[:-2].inv() * held[2:]).as_rotvec() / (2 * step)
    inside = slice(2 * fine, -2 * fine, fine)
    six = np.column_stack([acc[inside], gyr[2 * fine - 1 : -2 * fine + 1 : fine]])
    six += [*REST[:3] + [0.0, G, 0.0], *REST[3:]]
    return t[inside], six + NOISE * rng.standard_normal(six.shape)


def at_rest(t: Array, six: Array) -> tuple[Array, Array]:
    """Mean without the swaying, and its standard deviation."""
    found = find_sway(t, six)
    assert found
    parts = np.array_split(np.arange(len(t)), len(found))
    rest = np.vstack(
        [six[p] - w.outputs(t[p]) for p, w in zip(parts, found, strict=True)]
    )
    left = sum(w.excess_variance for w in found) / len(found) ** 2
    return rest.mean(axis=0), np.sqrt(NOISE**2 / len(t) + left)


@pytest.mark.parametrize(
    "hz",
    [
        (0.137,),
        pytest.param((0.2, 0.26, 0.31, 0.33), marks=pytest.mark.thorough),
        *(pytest.param((hz,), marks=pytest.mark.thorough) for hz in (0.1, 0.5)),
    ],
)
def test_means_are_those_of_a_base_at_rest(hz: tuple[float, ...]) -> None:
    """Within 1.5 of what they are uncertain by on firm ground, and as stated."""
    rng = np.random.default_rng(7)
    white = NOISE / np.sqrt(30 * RATE)
    off, sigma = [], []
    for _ in range(8):
        mean, sd = at_rest(*swayed(rng, hz))
        off.append(mean - REST)
        sigma.append(sd)
    pulls = np.array(off) / sigma
    assert 0.85 < np.sqrt((pulls**2).mean()) < 1.15
    assert (np.sqrt((np.array(off) ** 2).mean(axis=0)) < 1.5 * white).all()


@pytest.mark.parametrize(
    "hz",
    [pytest.param((0.137,), marks=pytest.mark.thorough), (0.2, 0.26, 0.31, 0.33)],
)
def test_accelerometers_alone_show_it_as_well(hz: tuple[float, ...]) -> None:
    """Mean forces as on firm ground; of what they turn about the vertical, nothing."""
    rng = np.random.default_rng(7)
    white = NOISE[:3] / np.sqrt(30 * RATE)
    off, sigma = [], []
    for _ in range(8):
        t, six = swayed(rng, hz)
        six[:, 3:] = np.nan
        mean, sd = at_rest(t, six)
        off.append((mean - REST)[:3])
        sigma.append(sd[:3])
    assert 0.75 < np.sqrt(((np.array(off) / sigma) ** 2).mean()) < 1.25
    assert (np.sqrt((np.array(off) ** 2).mean(axis=0)) < 1.5 * white).all()
    (found,) = find_sway(t, six)
    turned = 0.5 * np.deg2rad(1.0) ** 2  # <phi^2> of two axes
    assert found.mean_squares[0] == pytest.approx(turned, rel=0.25)
    pulse = 2 * np.pi * np.array(hz)
    assert found.mean_squares[1] / found.mean_squares[0] == pytest.approx(
        np.mean(pulse**2), rel=0.1
    )


def test_what_is_left_does_not_drift() -> None:
    """Half of a slow wave at an end is no drift of the device."""
    rng, tilt = np.random.default_rng(4), []
    for _ in range(4):
        t, six = swayed(rng, (0.085, 0.095, 0.1, 0.105, 0.115))
        (found,) = find_sway(t, six)
        s = (t - t.mean()) / np.ptp(t) * 2
        tilt.append((six - found.outputs(t)).T @ s / (s @ s))
    assert np.sqrt((np.array(tilt) ** 2).mean(axis=0)).max() < 6e-4


def test_less_than_a_period_tells_no_frequency() -> None:
    rng = np.random.default_rng(6)
    assert find_sway(*swayed(rng, (0.1,), seconds=9.0)) == []
    assert len(find_sway(*swayed(rng, (0.1,), seconds=16.0))) == 1


def test_an_arm_pulls_outward() -> None:
    """Three metres from the turning centre the mean of w x (w x r) is 5e-3 m/s^2."""
    rng, arm = np.random.default_rng(3), np.array([0.0, 3.0, 0.0])
    t, six = swayed(rng, (0.5,), arm=arm)
    found = find_sway(t, six)
    assert found[0].arm[1] == pytest.approx(3.0, abs=0.1)
    assert np.abs(at_rest(t, six)[0] - REST)[:3].max() < 4e-4


def test_a_minute_is_cut_and_a_base_at_rest_is_none() -> None:
    rng = np.random.default_rng(5)
    assert len(find_sway(*swayed(rng, (0.2,), seconds=70.0))) == 2
    assert find_sway(*swayed(rng, (0.2,), degrees=0.0)) == []


def test_what_pushes_and_does_not_turn_is_no_sway() -> None:
    """Gyroscopes that show a turning which accelerometers deny."""
    t, six = swayed(np.random.default_rng(5), (0.2,), degrees=0.0)
    six[:, 3] += 0.02 * np.sin(2 * np.pi * 0.08 * t)
    assert find_sway(t, six) == []


def test_missing_samples_and_short_windows() -> None:
    t, six = swayed(np.random.default_rng(9), (0.3,))
    six[100:130, 2] = np.nan
    found = find_sway(t, six)
    rest = np.nanmean(six - found[0].outputs(t), axis=0)
    assert np.abs((rest - REST) / NOISE * np.sqrt(len(t))).max() < 4
    assert find_sway(t[:20], six[:20]) == []


def test_an_angle_is_the_integral_of_its_rate() -> None:
    """Of a swing by one degree about y, with a bias."""
    t, pulse = 0.1 * np.arange(300), 2 * np.pi * 0.2
    y = np.zeros((300, 6))
    y[:, 4] = 0.03 + np.deg2rad(1.0) * pulse * np.cos(pulse * t)
    angle = sway._turn_angle(y, 0.1)
    np.testing.assert_allclose(np.rad2deg(np.ptp(angle, axis=0)), [0, 2, 0], rtol=0.01)


def test_waves_are_compared_by_how_far_they_turn() -> None:
    """A twentieth of a degree is noise beside one, however fast it goes to and fro."""
    hz, turned = np.array([0.1, 0.3, 1.4]), np.deg2rad([1.0, 0.3, 0.05])
    zero = np.zeros((3, 6))
    rates = np.outer(turned * 2 * np.pi * hz, [0.0, 0.0, 0.0, 0.6, 0.0, 0.8])
    waves = SwayWaves(
        hz, 0.0, zero, rates, REST[:3], np.zeros(3), np.zeros(6), NOISE**2, 0.1,
        (0.0, 30.0),
    )  # fmt: skip
    kept = sway._significant(waves)
    np.testing.assert_array_equal(kept.hz, [0.1, 0.3])
    np.testing.assert_array_equal(kept.sin, rates[:2])


def test_slow_and_irregular_swaying_needs_longer_windows() -> None:
    def seconds(*hz: float) -> float:
        wide = np.full((len(hz), 6), 0.1)
        return needed_seconds(
            SwayWaves(
                np.array(hz), 0.0, wide, wide, REST[:3], np.zeros(3), np.zeros(6),
                NOISE**2 / 5, 0.1, (0.0, 30.0),
            )
        )  # fmt: skip

    assert seconds(0.1) == 15.0  # 1.2 periods or more
    assert seconds(0.5) < seconds(0.06) < seconds(0.03, 0.04, 0.05, 0.06)


def test_who_says_that_it_sways_need_not_wait() -> None:
    t, six = swayed(np.random.default_rng(2), (0.5,))
    waiting, told = Stillness(), Stillness(sways=True)
    for one in (waiting, told):
        one.add(Block.of(t, six[:, :3], six[:, 3:]))
    assert not waiting.still and told.still
    turning = np.linspace(0.0, 3.0, len(t))
    acc = six[:, :3] + 5 * np.sin(turning)[:, None] ** 3
    for quick in (1.0, 3.0):
        told.add(
            Block.of(t + 30 * quick, acc, six[:, 3:] + 0.3 * np.sin(5 * t)[:, None])
        )
        assert not told.still


@pytest.mark.parametrize("unit", [1e6, 1e9])
def test_times_in_another_unit_take_no_memory(unit: float) -> None:
    """A window of 20 s would be cut into hundreds of millions of minutes."""
    t = np.arange(2000) / 100.0
    six = np.random.default_rng(1).normal(0.0, 1e-3, (2000, 6)) + [0, 0, 9.8, 0, 0, 0]
    assert find_sway(t * unit, six) == []


@pytest.mark.parametrize(
    ("seconds", "parts"), [(40.0, 1), (40.02, 2), (80.0, 2), (80.02, 3)]
)
def test_a_window_is_divided_from_its_first_sample_to_its_last(
    monkeypatch: pytest.MonkeyPatch, seconds: float, parts: int
) -> None:
    """One sample more than forty seconds is two stretches, of the samples in order."""
    seen: list[Array] = []

    def stretch(t: Array, six: Array) -> str:
        np.testing.assert_array_equal(six[:, 4], 3 * t)
        seen.append(t)
        return "waves"

    monkeypatch.setattr(sway, "_waves_of_stretch", stretch)
    t = np.append(np.arange(0.0, seconds - 0.015, 0.02), seconds)
    six = np.outer(t, [1.0, 0.0, 0.0, 0.0, 3.0, 0.0])
    assert len(find_sway(t, six)) == len(seen) == parts
    np.testing.assert_array_equal(np.concatenate(seen), t)


def test_one_stretch_that_does_not_sway_is_enough(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answers = ["waves", None, "waves"]
    monkeypatch.setattr(sway, "_waves_of_stretch", lambda _t, _six: answers.pop(0))
    t = np.arange(0.0, 110.0, 0.02)
    assert find_sway(t, np.zeros((len(t), 6))) == []
    assert answers == ["waves"]


def test_cells_are_means_of_whole_tenths_of_a_second() -> None:
    """None across a gap, and none of samples that are left over."""
    t = 7.0 + np.arange(253) / 50
    t[111:] += 0.5
    six = np.outer(t, np.arange(1.0, 7.0))
    found = sway._cells(t, six)
    assert found is not None
    at, y, length = found
    parts = [t[i : i + 5].mean() for i in range(0, 250, 5) if i != 110]
    np.testing.assert_allclose(at, parts)
    np.testing.assert_allclose(y, np.outer(parts, np.arange(1.0, 7.0)))
    assert length == pytest.approx(0.1)
    assert sway._cells(t[:79], six[:79]) is None  # fifteen cells
    few = sway._cells(t[:80], six[:80])
    assert few is not None and len(few[0]) == 16
    rare = sway._cells(3 * np.arange(16.0), np.zeros((16, 6)))
    assert rare is not None and len(rare[0]) == 16 and rare[2] == 3.0
    assert sway._cells(3 * np.arange(15.0), np.zeros((15, 6))) is None


def test_a_wave_above_a_hundredth_of_the_power_of_rotation_is_kept() -> None:
    """Of cosines and sines about all axes, as angles and not as rates."""
    hz, zero = np.array([0.1, 0.4, 0.9]), np.zeros((3, 6))
    cos, sin = zero.copy(), zero.copy()
    turned = np.array([[0.02, 0.0, 0.01], [0.0, 1.9e-3, 0.0], [0.0, -2.7e-3, 0.0]])
    cos[:, 3:] = turned * 2 * np.pi * hz[:, None]
    sin[:, 3:] = [[0.0, -0.005, 0.0], [0.0, 0.0, -1.0e-3], [0.0, 0.0, 0.0]]
    sin[:, 3:] *= 2 * np.pi * hz[:, None]
    waves = SwayWaves(
        hz, 0.0, cos, sin, REST[:3], np.zeros(3), np.zeros(6), NOISE**2, 0.1,
        (0.0, 30.0),
    )  # fmt: skip
    power = [4e-4 + 1e-4 + 2.5e-5, 1.9e-3**2 + 1e-6, 2.7e-3**2]
    assert [p > 0.01 * power[0] for p in power] == [True, False, True]
    np.testing.assert_array_equal(sway._significant(waves).hz, [0.1, 0.9])


def test_of_large_swaying_nothing_is_left_but_noise() -> None:
    """Squares at twice the frequency are subtracted once: no wave has them as well."""
    t, six = swayed(
        np.random.default_rng(3), (0.2,), degrees=6.0, arm=np.array([0.0, 3.0, 0.0])
    )
    (found,) = find_sway(t, six)
    left = six - found.outputs(t)
    np.testing.assert_allclose(left.std(axis=0), NOISE, rtol=0.1)
    assert (np.abs(left.mean(axis=0) - REST) < NOISE / 10).all()


def test_samples_in_pairs_fill_no_cell_of_their_usual_distance() -> None:
    """Most follow the one before after a tenth of the mean distance."""
    rng = np.random.default_rng(4)
    t, six = swayed(rng, (1.0,))
    late = np.arange(len(t)) % 3
    assert find_sway(t - 0.9 / RATE * late, six) == []
