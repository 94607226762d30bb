"""A device in a hand, whose force wanders by an angle that is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.hand_detection import force_wander_angle
from fieldcal.model.rows.hand_tremor import rows_of_recording as rows_in_a_hand
from fieldcal.model.rows.hand_tremor import turned_force
from fieldcal.model.rows.reduce import reduce_to_rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.session.description_file import parse_description

G = 9.81


RATE, SECONDS = 50.0, 10.0


NOISE = np.repeat([1e-3, 1e-4], 3)
STEADY = 15.0 * np.arange(12) + 2.0


ARM = 0.06
SLOWLY, QUICKLY = (0.15, 0.6), (1.0, 8.0)


def recording(
    angles: Array,
    seed: int = 4,
    band: tuple[float, float] = SLOWLY,
    windows: int = 12,
    **known: float,
) -> RowSource:
    """Windows in which a hand turns by `angles` (w, 3) rad, rms about each axis.

    At frequencies of a band, Hz; with an arm about which the device is swung. Outputs
    of the accelerometers are twice the force, those of gyroscopes are SI.
    """
    rng, many = np.random.default_rng(seed), len(angles)
    t = np.arange(0.0, 15.0 * many, 1 / RATE)
    places: list[dict[str, Any]] = [
        {"start_s": float(s), "end_s": float(s) + SECONDS} | known
        for s in STEADY[: min(many, windows)]
    ]
    window = np.minimum(t // 15, many - 1).astype(int)
    hz = rng.uniform(*band, (8, 3))
    phase = (
        np.multiply.outer(t, 2 * np.pi * hz) + rng.uniform(0, 6.3, (many, 8, 3))[window]
    )
    turned = 0.5 * angles[window] * np.cos(phase).sum(axis=1)
    rate = -0.5 * angles[window] * (2 * np.pi * hz * np.sin(phase)).sum(axis=1)
    swung = 0.5 * angles[window] * ((2 * np.pi * hz) ** 2 * np.cos(phase)).sum(axis=1)
    up = np.eye(3)[window % 3]
    force = G * (up - np.cross(turned, up)) - ARM * swung * (band is QUICKLY)
    six: Array = np.hstack([2.0 * force, rate])
    six += NOISE * rng.standard_normal(six.shape)
    about = parse_description({
        "format": 1, "position": places, "site": {"gravity": G},
        "nominal": {"acc_scale": [2.0] * 3},
    })  # fmt: skip
    block = Block.of(t, six[:, :3], six[:, 3:])
    usable = np.ones((len(t), 6), dtype=bool)
    return RowSource(block, about, usable, np.zeros(many), Thermometer.of(block))


def test_in_a_hand_each_window_is_one_row() -> None:
    angle = 5e-3
    source = recording(np.full((5, 3), angle))
    found = rows_in_a_hand(source)
    assert found.x.position.tolist() == [0, 1, 2, 3, 4]
    for i, start in enumerate(STEADY[:5]):
        some = source.block.between(start, start + SECONDS)
        np.testing.assert_allclose(found.y[i], some.six.mean(axis=0), atol=1e-12)
        np.testing.assert_allclose(found.x.variance[i], some.acc.var(axis=0) / 4)
    np.testing.assert_allclose(found.sd[:, :3], np.tile(found.noise[:3], (5, 1))
                               / 500**0.5, rtol=1e-9)  # fmt: skip
    assert found.hand_angle.shape == (5, 3)
    assert np.sqrt((found.hand_angle**2).mean(axis=1)) == pytest.approx(angle, rel=0.3)
    assert (
        found.window_error.shape == (5, 6) and (found.window_error[:, 3:] > 4e-5).all()
    )


UNIT = np.array([4.0, -0.5, 8.0])


@pytest.mark.parametrize("kind", ["calm", "quick", "some"])
def test_the_unit_of_gyroscopes_changes_no_angle(kind: str) -> None:
    """Errors of their means are in that unit, as the means are."""
    angles = np.full((5, 3), 5e-3)
    if kind == "some":
        angles = np.zeros((12, 3))
        angles[7] = 3e-3
    source = recording(angles, band=SLOWLY if kind == "calm" else QUICKLY)
    nominal = {**source.about.nominal, "gyr_scale": UNIT}
    block = replace(source.block, gyr=source.block.gyr * UNIT)
    about = replace(source.about, nominal=nominal)
    plain = rows_in_a_hand(source)
    found = rows_in_a_hand(replace(source, block=block, about=about))
    assert plain.hand_angle.any()
    np.testing.assert_allclose(found.hand_angle, plain.hand_angle, rtol=1e-5)
    np.testing.assert_allclose(found.sd[:, :3], plain.sd[:, :3], rtol=1e-5)
    np.testing.assert_allclose(found.sd[:, 3:], plain.sd[:, 3:] * np.abs(UNIT), 1e-5)
    np.testing.assert_allclose(found.y[:, 3:], plain.y[:, 3:] * UNIT, rtol=1e-5)
    wide = plain.window_error[:, 3:] * np.abs(UNIT)
    np.testing.assert_allclose(found.window_error[:, 3:], wide)


def off_and_told(angles: Array, seeds: range) -> tuple[Array, Array]:
    """What mean rates are off by, and what is told of it, (s, 5, 3) each.

    Of the recordings that show a hand.
    """
    found = [rows_in_a_hand(recording(angles, seed)) for seed in seeds]
    shown = [one for one in found if one.hand_angle.all()]
    assert len(shown) > len(seeds) / 2
    off = np.array([one.y[:, 3:] for one in shown])
    return off, np.array([one.sd[:, 3:] for one in shown])


@pytest.mark.thorough
def test_mean_rates_are_as_unsteady_as_the_hand_was_there_about_each_axis() -> None:
    """Angles a hundred times as large in one window as in another."""
    angles = np.geomspace(2e-4, 2e-2, 15).reshape(5, 3)[:, [2, 0, 1]]
    off, told = off_and_told(angles, range(4, 44))
    rms, least = np.sqrt((told**2).mean(axis=0)), 2**0.5 * angles / SECONDS
    np.testing.assert_allclose(rms[-1], least[-1], rtol=0.25)
    assert (rms > 0.9 * least).all()
    pulls = np.sqrt(((off / told) ** 2).mean(axis=0))
    assert (pulls < 1.3).all() and (pulls[-1] > 0.6).all()


def test_of_one_that_trembles_alike_everywhere_the_pulls_are_even() -> None:
    off, told = off_and_told(np.full((5, 3), 5e-3), range(4, 14))
    assert np.sqrt(((off / told) ** 2).mean()) == pytest.approx(0.8, abs=0.2)


def test_a_hand_that_is_calm_most_of_the_time_is_one() -> None:
    """What one window does is no course that windows share."""
    angles = np.full((5, 3), 2e-4)
    angles[4] = 2e-2
    assert all(
        force_wander_angle(reduce_to_rows(recording(angles, seed)), False) > 0
        for seed in range(20)
    )


def test_on_a_table_rows_are_as_ever() -> None:
    found = rows_in_a_hand(recording(np.zeros((5, 3))))
    assert len(found.x) == 50 and found.hand_angle.max() == 0.0


def test_a_quick_hand_is_no_noise_of_the_sensors() -> None:
    """Means are nearly as good as on a table, and turns are followed as on one."""
    pulls, along = [], []
    for seed in range(6):
        angles = np.full((5, 3), 1e-3)
        found = rows_in_a_hand(recording(angles, seed, QUICKLY))
        assert len(found.x) == 5 and 0.5e-3 < found.hand_angle.mean() < 1.5e-3
        assert (found.noise < 30 * NOISE).all()
        loud = rows_of_seed(seed).noise
        assert (found.noise[3:] < 0.3 * loud[3:]).all(), "what trembles is no noise"
        pulls.append(found.y[:, 3:] / found.sd[:, 3:])
        norm = np.linalg.norm(found.y[:, :3], axis=1) - 2.0 * G
        along.append(norm / found.sd[:, 0])
    assert 0.2 < np.sqrt(np.mean(np.square(pulls))) < 1.3
    assert 0.2 < np.sqrt(np.mean(np.square(along))) < 1.3


def test_a_table_that_trembles_turns_no_force() -> None:
    """Accelerometers keep their blocks, in which what settles shows.

    Gyroscopes have one row for each window, and their means are off by what trembles.
    """
    pulls, along = [], []
    for seed in range(6):
        source = recording(np.full((5, 3), 2e-5), seed, (1.0, 8.1))
        found = rows_in_a_hand(source)
        assert 1e-5 < found.hand_angle.mean() < 3e-5
        acc, gyr = found.used[:, :3].all(axis=1), found.used[:, 3:].all(axis=1)
        assert (acc != gyr).all() and acc.sum() == 5 * 10
        assert found.x.position[gyr].tolist() == [0, 1, 2, 3, 4]
        assert found.length[gyr] == pytest.approx(SECONDS, abs=0.1)
        assert found.noise == pytest.approx(NOISE * np.repeat([1, 2], 3), rel=0.6)
        pulls.append(found.y[gyr, 3:] / found.sd[gyr, 3:])
        norm = np.linalg.norm(found.y[acc, :3], axis=1) - 2.0 * G
        along.append(norm / found.sd[acc, 0])
    assert 0.2 < np.sqrt(np.mean(np.square(pulls))) < 1.3
    assert 0.8 < np.sqrt(np.mean(np.square(along))) < 1.2


@pytest.mark.thorough
def test_where_it_is_quick_in_some_windows_the_others_tell_the_noise() -> None:
    """Half of them tremble so quickly that one sample shows it from the next."""
    angles = np.zeros((12, 3))
    angles[::2] = 2e-3
    found = [rows_in_a_hand(recording(angles, s, (8.0, 12.0))).noise for s in range(8)]
    assert np.mean(found, axis=0)[3:] == pytest.approx(NOISE[3:], rel=0.1)


def rows_of_seed(seed: int) -> Rows:
    return reduce_to_rows(recording(np.full((5, 3), 1e-3), seed, QUICKLY))


def test_only_a_device_that_somebody_holds_trembles() -> None:
    """Positions of a fixture have angles; of three windows nobody can tell."""
    angles = np.full((5, 3), 1e-3)
    fixed = recording(angles, 4, QUICKLY, alpha_deg=0.0, beta_deg=2.0)
    for held in (fixed, recording(angles, 4, QUICKLY, 3)):
        assert rows_in_a_hand(held).hand_angle.max() == 0.0
    assert rows_in_a_hand(recording(angles, 4, QUICKLY, 4)).hand_angle.all()


def test_of_one_that_is_held_in_some_windows_their_means_are_unsteady() -> None:
    """And what is told of them is what they are off by, also in the others."""
    angles = np.zeros((12, 3))
    angles[7] = 3e-3
    pulls, others = [], []
    for seed in range(4):
        source = recording(angles, seed, QUICKLY)
        found, blocks = rows_in_a_hand(source), reduce_to_rows(source)
        held, there = found.x.position == 7, blocks.x.position == 7
        assert held.sum() == 1
        np.testing.assert_array_equal(found.noise, blocks.noise)
        np.testing.assert_array_equal(found.y[~held], blocks.y[~there])
        np.testing.assert_array_equal(found.sd[~held], blocks.sd[~there])
        pulls.append(found.y[held, 3:] / found.sd[held, 3:])
        others.append(found.y[~held, 3:] / found.sd[~held, 3:])
    assert 0.3 < np.sqrt(np.mean(np.square(pulls))) < 1.2
    assert 0.8 < np.sqrt(np.mean(np.square(others))) < 1.1


def test_in_a_fixture_a_hand_turns_known_angles_about_its_own_axis() -> None:
    """Means of the force are off by that across it, and no others are."""
    angles = np.zeros((12, 3))
    angles[7, 0] = 3e-3  # the force lies along y there
    for seed in range(3):
        source = recording(angles, seed, QUICKLY, alpha_deg=0.0, beta_deg=0.0)
        found = rows_in_a_hand(source)
        held = found.x.position == 7
        assert found.hand_angle[held, 0] == pytest.approx(3e-3, rel=0.5)
        assert (found.hand_angle[held, 1:] < 2e-4).all() and not found.hand_angle[
            ~held
        ].any()
        off = np.abs(
            np.cross([found.hand_angle[held][0, 0], 0.0, 0.0], found.x.f[held][0])
        )
        assert found.sd[held][0, 2] == pytest.approx(2.0 * off[2], rel=0.05)
        blocks = reduce_to_rows(source)
        np.testing.assert_array_equal(
            found.sd[~held], blocks.sd[blocks.x.position != 7]
        )


def test_of_a_force_that_is_turned_the_covariance_is_that_of_many() -> None:
    force, angle = np.array([1.0, -9.0, 3.0]), np.array([1e-3, 2e-3, 4e-3])
    some = angle * np.random.default_rng(1).normal(size=(200_000, 3))
    seen = np.cov(np.cross(some, force).T)
    np.testing.assert_allclose(turned_force(force, angle), seen, atol=1e-6)


def test_a_table_that_shakes_in_some_windows_is_no_hand() -> None:
    """White noise of one window is larger, as of an engine far above the rate."""
    for seed in range(6):
        source = recording(np.zeros((12, 3)), seed)
        rng, at = np.random.default_rng(seed), source.block.t // 15 == 4
        shaken = source.block.gyr + 1e-3 * at[:, None] * rng.normal(size=(len(at), 3))
        found = rows_in_a_hand(replace(source, block=replace(source.block, gyr=shaken)))
        assert len(found.x) == 120 and not found.hand_angle.any()


def test_a_bump_in_one_window_is_no_hand() -> None:
    source = recording(np.zeros((12, 3)), 7)
    at = (source.block.t > 63.0) & (source.block.t < 65.0)
    rng = np.random.default_rng(7)
    gyr = source.block.gyr + 1e-2 * at[:, None] * rng.normal(size=(len(at), 3))
    swung = np.sin(2 * np.pi * 1.5 * source.block.t)[:, None] * [3e-2, 1e-2, 0.0]
    gyr += swung * at[:, None]
    found = rows_in_a_hand(replace(source, block=replace(source.block, gyr=gyr)))
    assert len(found.x) == 120 and not found.hand_angle.any()


def test_an_axis_that_tells_nothing_leaves_the_others() -> None:
    """Missing in a window, or without noise; of none nobody can tell."""
    angles = np.zeros((12, 3))
    angles[7] = 3e-3
    source = recording(angles, 5, QUICKLY)
    gyr, at = source.block.gyr.copy(), source.block.t // 15 == 2
    gyr[at, 0], gyr[:, 1] = np.nan, 0.0
    block = replace(source.block, gyr=gyr)
    usable = np.hstack([source.usable[:, :3], np.isfinite(gyr)])
    found = rows_in_a_hand(replace(source, block=block, usable=usable))
    held = found.x.position == 7
    assert held.sum() == 1 and found.hand_angle[held].any()
    block = replace(source.block, gyr=np.zeros_like(gyr))
    assert len(rows_in_a_hand(replace(source, block=block)).x) == 120


def test_gyroscopes_alone_show_a_hand_as_well() -> None:
    angles = np.zeros((12, 3))
    angles[7] = 3e-3
    source = recording(angles, 5, QUICKLY)
    block = replace(source.block, acc=np.full_like(source.block.acc, np.nan))
    usable = np.hstack([np.zeros_like(source.usable[:, :3]), source.usable[:, 3:]])
    found = rows_in_a_hand(replace(source, block=block, usable=usable))
    assert not found.x.f.any() and found.hand_angle[found.x.position == 7].any()
    assert np.isfinite(found.sd[:, 3:]).all()
