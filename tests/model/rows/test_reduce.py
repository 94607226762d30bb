"""Block means of a recording that is written down sample by sample."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from still_samples import FORCE, G, about, place, samples, source

from fieldcal.core.frames import EARTH_RATE
from fieldcal.model.rows.orientation import gyro_readings
from fieldcal.model.rows.reduce import reduce_to_rows


def test_rows_are_means_over_a_second_with_their_noise() -> None:
    block = samples(40.0)
    acc = block.acc.copy()
    acc[block.t > 20.0] += np.subtract(FORCE[90.0], FORCE[0.0])
    block = replace(block, acc=acc)
    known = about(place(3.0, 13.0), place(25.0, 35.0, 90.0))
    rows = reduce_to_rows(source(block, known))
    assert rows.x.position.tolist() == [0] * 10 + [1] * 10
    for i, first in enumerate([*range(50, 550, 50), *range(1150, 1650, 50)]):
        some = slice(first, first + 50)
        np.testing.assert_allclose(rows.y[i], block.six[some].mean(axis=0), atol=1e-12)
        ends = block.t[first], block.t[first + 49]
        np.testing.assert_allclose(rows.span[i], ends)
        assert rows.x.t[i] == pytest.approx(np.mean(ends))
        assert rows.x.since_start[i] == pytest.approx(np.mean(ends) - 2.0)
        np.testing.assert_allclose(rows.x.f[i], FORCE[90.0 if i > 9 else 0.0],
                                   atol=1e-12)  # fmt: skip
    np.testing.assert_allclose(rows.length, 1.0)
    np.testing.assert_allclose(rows.x.lasts, 1.0)
    white = np.repeat([0.01, 1e-3], 3)
    np.testing.assert_allclose(rows.noise, white, rtol=0.1)
    np.testing.assert_allclose(rows.sd, np.tile(rows.noise / 50**0.5, (20, 1)))
    np.testing.assert_allclose(rows.x.variance, np.tile(rows.noise[:3] ** 2, (20, 1)))
    assert (rows.window_error < 1e-6).all() and not rows.hand_angle.any()
    assert rows.used.all() and not rows.x.base_rate.any()
    np.testing.assert_allclose(rows.x.warming, 0.01 * (rows.x.t - 2.0), atol=1e-6)
    np.testing.assert_allclose(rows.x.heating, 0.01, rtol=1e-3)
    assert rows.x.latitude == pytest.approx(np.deg2rad(50.0))
    assert rows.x.gravity == pytest.approx(G)


def test_the_time_since_a_turn_counts_from_the_arrival() -> None:
    block = samples(40.0)
    known = about(place(3.0, 13.0), place(25.0, 35.0))
    one = replace(source(block, known), rest_began=np.array([2.5, 21.0]))
    x = reduce_to_rows(one).x
    since = x.t - np.where(x.position == 1, 21.0, 2.5)
    np.testing.assert_allclose(x.since_turn, since)


def test_joints_are_those_of_angles_that_were_set_and_not_measured() -> None:
    block = samples(60.0)
    known = about(place(3.0, 13.0), place(25.0, 35.0, 90.0), place(40.0, 50.0))
    arrived = np.array([2.5, 21.0, 38.0])
    turns = reduce_to_rows(
        replace(source(block, known), rest_began=arrived)
    ).x.joint_turns
    assert turns.at.tolist() == [21.0, 38.0]
    assert turns.side[:, 0].tolist() == [1.0, -1.0]
    first, *rest = known.positions
    measured = replace(known, positions=(replace(first, sigma=1e-3), *rest))
    turns = reduce_to_rows(
        replace(source(block, measured), rest_began=arrived)
    ).x.joint_turns
    assert turns.at.tolist() == [38.0] and turns.side[:, 0].tolist() == [-1.0]


def test_joints_were_not_turned_to_where_the_device_was_never_held() -> None:
    known = about(
        place(3.0, 13.0), {"alpha_deg": 90.0, "beta_deg": 5.0},
        place(25.0, 35.0, 45.0), place(100.0, 110.0, 90.0),
    )  # fmt: skip
    arrived = np.array([2.5, 2.0, 21.0, 2.0])
    one = replace(source(samples(40.0), known), rest_began=arrived)
    turns = reduce_to_rows(one).x.joint_turns
    assert turns.at.tolist() == [21.0] and turns.side.tolist() == [[1.0, 0.0]]


def test_a_device_that_sees_the_earth_has_its_rate() -> None:
    block, device = samples(20.0), {"grade": "navigation", "name": "a"}
    x = reduce_to_rows(source(block, about(place(3.0, 13.0), device=device))).x
    angle = np.deg2rad(50.0)
    expected = EARTH_RATE * np.array([0.0, -np.sin(angle), np.cos(angle)])
    np.testing.assert_allclose(x.base_rate, expected)


def test_rows_of_samples_that_are_missing() -> None:
    block = samples(12.0)
    gyr = block.gyr.copy()
    gyr[60:70, 1], gyr[100:150, 2] = np.nan, np.nan
    block = replace(block, gyr=gyr)
    one = source(block, about(place(2.0, 12.0)))
    one.usable[:25, 0] = False
    rows = reduce_to_rows(one)
    assert rows.y[0, 0] == pytest.approx(block.acc[25:50, 0].mean(), abs=1e-12)
    assert rows.sd[0, 0] == pytest.approx(rows.noise[0] / 5.0)
    kept = [*range(50, 60), *range(70, 100)]
    assert rows.y[1, 4] == pytest.approx(block.gyr[kept, 1].mean(), abs=1e-12)
    assert rows.sd[1, 4] == pytest.approx(rows.noise[4] / 40**0.5)
    assert np.isnan(rows.y[2, 5]) and np.isnan(rows.sd[2, 5])
    unused = np.zeros((10, 6), dtype=bool)
    unused[2, 5] = True
    np.testing.assert_array_equal(rows.used, ~unused)
    fewer = rows.without(np.arange(10) == 4)
    np.testing.assert_array_equal(fewer.used, rows.used & (np.arange(10) != 4)[:, None])


def test_what_never_changes_tells_nothing() -> None:
    block = samples(12.0)
    gyr = block.gyr.copy()
    gyr[:, 0] = 0.01
    rows = reduce_to_rows(source(replace(block, gyr=gyr), about(place(2.0, 12.0))))
    np.testing.assert_array_equal(
        rows.used.all(axis=0), [True] * 3 + [False, True, True]
    )


def test_a_window_of_one_sample_has_no_row() -> None:
    rows = reduce_to_rows(
        source(samples(12.0), about(place(2.0, 2.01), place(3.0, 9.0)))
    )
    assert set(rows.x.position) == {1}


def test_of_unknown_orientation_the_force_is_along_what_is_read() -> None:
    """And the Earth may turn the device about any axis, once it was moved."""
    block = samples(30.0)
    known = about(place(3.0, 13.0, None), place(15.0, 25.0), nominal={
        "acc_bias": [0.0, 1.0, 0.5], "acc_scale": [1.0, 2.0, 1.0],
        "gyr_scale": [1.0, -2.0, 1.0],
    })  # fmt: skip
    rows = reduce_to_rows(source(block, known))
    free = rows.x.position == 0
    read = (np.subtract(FORCE[0.0], [0.0, 1.0, 0.5])) / [1.0, 2.0, 1.0]
    along = G * read / np.linalg.norm(read)
    np.testing.assert_allclose(rows.x.f[free], np.tile(along, (10, 1)), atol=0.01)
    np.testing.assert_allclose(rows.x.f[~free], np.tile(FORCE[0.0], (10, 1)))
    earth = EARTH_RATE / 3**0.5 * np.array([1.0, 2.0, 1.0])
    np.testing.assert_allclose(
        rows.window_error[free, 3:], np.tile(earth, (10, 1)), rtol=0.01
    )
    assert (rows.window_error[~free] < 1e-6).all() and (
        rows.window_error[:, :3] < 1e-4
    ).all()
    alone = reduce_to_rows(source(block, about(place(3.0, 13.0, None))))
    assert (alone.window_error < 1e-6).all()
    nowhere = reduce_to_rows(source(block, about()))
    assert not nowhere.x.oriented.any() and (nowhere.window_error < 1e-6).all()


def test_coarse_outputs_may_be_off_all_through_a_window() -> None:
    block = samples(12.0, acc=1e-4)
    acc = block.acc.copy()
    acc[:, 0] = 0.05 * np.round(block.acc[:, 0] / 0.05)
    acc[30, 0] = 0.05
    rows = reduce_to_rows(source(replace(block, acc=acc), about(place(2.0, 12.0))))
    np.testing.assert_allclose(rows.window_error[:, 0], 0.05 / 12**0.5, rtol=0.02)
    assert (rows.window_error[:, 1:] < 1e-6).all()


def test_what_a_dead_band_hides_of_gyroscopes_is_the_same_at_every_rest() -> None:
    """Of accelerometers it is something else in every position."""
    block, band = samples(30.0), 4e-3
    acc, gyr = block.acc.copy(), block.gyr.copy()
    turning = block.t > 15.0
    acc[:, 0], gyr[:, 2] = acc[:, 0] % 0.05, band / 2
    acc[turning, 0] += 1.0
    gyr[turning, 2] = np.linspace(0.5, 5.0, turning.sum()) * band
    acc[:, 0] = np.where(acc[:, 0] < 0.04, 0.0, acc[:, 0])
    gyr[:, 2] = np.where(gyr[:, 2] < band, 0.0, gyr[:, 2])
    held = place(2.0, 8.0), place(9.0, 14.0)
    rows = reduce_to_rows(source(replace(block, acc=acc, gyr=gyr), about(*held)))
    assert rows.session_error[5] == pytest.approx(band / 3**0.5, rel=0.1)
    assert not rows.session_error[:5].any()
    np.testing.assert_allclose(rows.window_error[:, 0], 0.04 / 3**0.5, rtol=0.1)
    assert (rows.window_error[:, 1:] < 1e-5).all()


def test_where_the_force_points_is_not_known_of_two_axes() -> None:
    """Of a free window; where the angles are known the two are as good as ever."""
    block, held = samples(30.0), (place(2.0, 8.0), place(9.0, 14.0))
    acc = block.acc.copy()
    acc[block.t < 8.5, 1] = np.nan
    some = replace(block, acc=acc)
    free = [{k: v for k, v in one.items() if "deg" not in k} for one in held]
    rows = reduce_to_rows(source(some, about(*free)))
    first = rows.x.position == 0
    assert not rows.used[first, :3].any() and rows.used[first, 3:].all()
    assert rows.used[~first].all()
    told = reduce_to_rows(source(some, about(*held)))
    np.testing.assert_array_equal(told.used[first, :3], [[True, False, True]] * 6)


def test_a_table_that_turns_hides_the_force_across_its_axis() -> None:
    turned = [
        place(3.0, 13.0) | {"rate_deg_s": w} for w in ([0, 90.0, 0], [30.0, 0, 0])
    ]
    turned[1] |= {"start_s": 15.0, "end_s": 25.0}
    known = about(*turned)
    rows = reduce_to_rows(source(samples(30.0), known))
    upright = rows.x.position == 0
    assert rows.used[upright].all() and not rows.used[~upright, :3].any()
    rates = gyro_readings(known, rows.x.position, rows.y[:, 3:]).rates(np.eye(3))
    expected = np.deg2rad(np.where(upright[:, None], [0, 90.0, 0], [30.0, 0, 0]))
    np.testing.assert_allclose(rates, expected)
    none = gyro_readings(about(), np.zeros(4, int), np.zeros((4, 3)))
    np.testing.assert_array_equal(none.rates(np.eye(3)), np.zeros((4, 3)))


def test_what_goes_round_with_a_table_is_taken_out_of_its_window_alone() -> None:
    """90 deg/s about a vertical axis; the Earth's rate goes round in the others."""
    block = samples(40.0)
    gyr = block.gyr * 1e-3
    angle = np.pi / 2 * (block.t - 2.0)
    round_ = 5e-5 * np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)])
    gyr += round_
    gyr[:, 1] += np.where(block.t < 20.0, np.pi / 2, 0.0)
    known = about(place(3.0, 18.3) | {"rate_deg_s": [0, 90.0, 0]}, place(22.0, 35.0))
    rows = reduce_to_rows(source(replace(block, gyr=gyr), known))
    on = rows.x.position == 0
    assert np.abs(rows.y[on][:, [3, 5]]).max() < 1e-6
    assert np.abs(rows.y[~on][:, [3, 5]]).max() > 2e-5
    np.testing.assert_allclose(rows.y[on, 4], np.pi / 2, atol=1e-6)
