"""Rows in motion: cosine coefficients, reference and alignment, by slow sums."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.motion import Alignment, MotionRows, frequencies
from fieldcal.model.rows.motion_reduction import common_samples, rows_in_motion
from fieldcal.model.rows.reference import Reference
from fieldcal.model.rows.response import Response
from fieldcal.physics.experience import Experience

LENGTH, COUNT = 6, 4
STILL = Alignment(0.0, 0.0, 0.0)


def reference(hz: float = 50.0, seconds: float = 40.0) -> Reference:
    t = np.arange(0.0, seconds, 1 / hz)
    return Reference(Block.of(t, course(t)[:, :3], course(t)[:, 3:]))


def course(t: Array) -> Array:
    return np.stack([np.sin((0.7 + 0.1 * c) * t + c) for c in range(6)], axis=1)


def rows(alignment: Alignment = STILL, per_row: int = 2) -> MotionRows:
    t = np.arange(5.0, 30.0, 0.02)
    block = Block.of(t, course(t)[:, :3], course(t)[:, 3:])
    return rows_in_motion(block, reference(), alignment, per_row, 2.0, 1.0)


def cosines(values: Array) -> Array:
    """Equation (2) as it is written."""
    n = len(values)
    j = np.arange(n) + 0.5
    table = np.array([np.cos(np.pi * k * j / n) for k in range(n)]) * np.sqrt(2 / n)
    table[0] /= np.sqrt(2)
    out: Array = table @ values
    return out


def test_coefficients_are_the_sums_that_are_written() -> None:
    there = rows()
    values = np.random.default_rng(1).standard_normal((len(there), 3))
    apart = values.reshape(-1, there.length, 3)
    expected = np.stack([cosines(one) for one in apart])
    expected[:, 0] = cosines(expected[:, 0])
    found = there.cosines(values)
    np.testing.assert_allclose(found, expected.reshape(values.shape), atol=1e-12)
    assert (found**2).sum() == pytest.approx((values**2).sum())


def test_coefficients_of_some_stretches_are_those_of_their_rows() -> None:
    there = rows()
    values = np.random.default_rng(2).standard_normal((len(there), 2))
    some = np.array([0, 3, 4])
    kept = values.reshape(-1, there.length, 2)[some]
    expected = np.stack([cosines(one) for one in kept])
    expected[:, 0] = cosines(expected[:, 0])
    found = there.select_stretches(there.cosines(values), some)
    np.testing.assert_allclose(found, expected.reshape(found.shape), atol=1e-12)


def test_a_cosine_lies_at_its_frequency() -> None:
    step, k = 0.1, 4
    hz = frequencies(COUNT * LENGTH, LENGTH, step)
    t = (np.arange(LENGTH) + 0.5) * step
    share = np.abs(cosines(np.cos(2 * np.pi * hz[k] * t)[:, None]))[:, 0]
    assert int(np.argmax(share)) == k and np.delete(share, k).max() < 1e-12
    slow = hz[::LENGTH]
    np.testing.assert_allclose(slow, np.arange(COUNT) / (2 * COUNT * LENGTH * step))


def test_the_motion_is_that_of_the_reference_where_the_recording_stands() -> None:
    turn = Rotation.from_rotvec([0.2, 0.5, -1.0]).as_matrix()
    there = rows(Alignment(0.3, 1e-3, 12.0, turn))
    s = there.t - 0.3 + 1e-3 * (there.t - 12.0)
    every = course(s.ravel()).reshape(*s.shape, 6).mean(axis=1)
    found = there.motion(there.acc)
    np.testing.assert_allclose(found[:, :3], every[:, :3] @ turn.T, atol=1e-6)
    np.testing.assert_allclose(found[:, 3:], every[:, 3:] @ turn.T, atol=1e-6)
    step = 1e-4
    early, late = (
        there.motion(Response.of(there.reference, by)) for by in (-step, step)
    )
    change = (early - late) / (2 * step)
    slope = there.motion(there.acc, 1)
    np.testing.assert_allclose(slope, change / (1 + 1e-3), atol=2e-3)


@pytest.mark.parametrize(("per_row", "taken"), [(3, 3), (5, 1), (12, 1)])
def test_rows_of_many_samples_are_means_of_the_motion(per_row: int, taken: int) -> None:
    turn = Rotation.from_rotvec([0.2, 0.5, -1.0]).as_matrix()
    there = rows(Alignment(0.3, 1e-3, 12.0, turn), per_row)
    assert there.t.shape[1] == per_row and there.at.shape[1] == taken
    s = there.t - 0.3 + 1e-3 * (there.t - 12.0)
    every = course(s.ravel()).reshape(*s.shape, 6).mean(axis=1)
    found = there.motion(there.acc)
    np.testing.assert_allclose(found[:, :3], every[:, :3] @ turn.T, atol=3e-6)
    np.testing.assert_allclose(found[:, 3:], every[:, 3:] @ turn.T, atol=3e-6)
    step = 1e-4
    early, late = (there.motion(replace(there.acc, late=by)) for by in (-step, step))
    change = (early - late) / (2 * step)
    slope = there.motion(there.acc, 1)
    np.testing.assert_allclose(slope, change / (1 + 1e-3), atol=2e-3)


def test_uneven_samples_are_each_held_against_the_motion() -> None:
    even = np.arange(5.0, 30.0, 0.02)
    t = even + np.random.default_rng(4).normal(0, 2e-3, len(even))
    block = Block.of(t, course(t)[:, :3], course(t)[:, 3:])
    there = rows_in_motion(block, reference(), STILL, 12, 2.0, 1.0)
    assert there.at.shape[1] == 12
    np.testing.assert_allclose(there.y, there.motion(there.acc), atol=1e-6)


def test_what_stamps_miss_is_the_change_in_the_time_that_they_are_off_by() -> None:
    even = np.arange(5.0, 30.0, 0.02)
    off = np.random.default_rng(4).normal(0, 2e-3, len(even))
    block = Block.of(even + off, course(even)[:, :3], course(even)[:, 3:])
    there = rows_in_motion(block, reference(), STILL, 2, 2.0, 1.0)
    stamped = there.motion(there.acc)
    missed = there.experience(there.acc).missed
    # samples are those of even times: less what the stamps miss, they agree
    assert np.abs(there.y - stamped).max() > 2e-3
    np.testing.assert_allclose(there.y, stamped - missed, atol=4e-4)
    known = replace(there, share=1.0)
    np.testing.assert_allclose(there.y, known.motion(known.acc), atol=4e-4)


def test_even_stamps_miss_nothing() -> None:
    there = rows(per_row=1)
    assert not there.uneven.any() and not there.experience(there.acc).missed.any()


def test_the_bend_is_the_second_derivative_in_the_axes_of_the_device() -> None:
    turn = Rotation.from_rotvec([0.2, 0.5, -1.0]).as_matrix()
    there = rows(Alignment(0.3, 0.0, 0.0, turn), per_row=1)
    expected = -((0.7 + 0.1 * np.arange(6)) ** 2) * course(there.middles - 0.3)
    found = there.experience(there.acc)
    np.testing.assert_allclose(found.f_bend, expected[:, :3] @ turn.T, atol=5e-3)
    np.testing.assert_allclose(found.w_bend, expected[:, 3:] @ turn.T, atol=5e-3)
    between = np.diff(found.f, axis=0) / np.diff(there.middles)[:, None]
    np.testing.assert_allclose((found.f_dot[1:] + found.f_dot[:-1]) / 2, between,
                               atol=1e-2)  # fmt: skip


def test_the_temperature_is_known_between_the_readings_of_a_thermometer() -> None:
    """One that is read once a second leaves a gap in nearly every row."""
    t = np.arange(0.0, 40.0, 0.02)
    degrees = 20 + 0.3 * t
    read = np.where(np.arange(len(t)) % 50 == 7, degrees, np.nan)
    for temperature in (degrees, read, np.where(t < 3, np.nan, degrees)):
        x = warmed(t, temperature)
        assert x.warms
        within = (x.t > 4) & (x.t < 39)
        np.testing.assert_allclose(x.warming[within], 0.3 * x.t[within], atol=1e-2)
        np.testing.assert_allclose(x.heating[within], 0.3, atol=1e-2)


def test_the_noise_of_a_thermometer_is_no_change_of_temperature() -> None:
    t = np.arange(0.0, 40.0, 0.02)
    assert not warmed(t, np.full(len(t), np.nan)).warms
    noise = np.random.default_rng(3).normal(0, 0.01, len(t))
    assert not warmed(t, 20 + noise).warms


def test_gyroscopes_that_are_read_half_as_often_leave_rows_without_gaps() -> None:
    t = np.arange(5.0, 30.0, 0.02)
    acc, gyr, odd = course(t)[:, :3], course(t)[:, 3:].copy(), np.arange(len(t)) % 2
    gyr[odd == 0] = np.nan
    read = np.where(odd == 0, 20 + 0.3 * t, np.nan)
    both = replace(Block.of(t, acc, gyr), temperature=read)
    thinned = common_samples(both, reference())
    np.testing.assert_array_equal(thinned.t, t[1::2])
    there = rows_in_motion(thinned, reference(), STILL, 2, 2.0, 1.0)
    assert len(there) * there.step > 22 and there.step == pytest.approx(0.08)
    np.testing.assert_allclose(there.y, there.motion(there.acc), atol=1e-6)
    assert there.experience(there.acc).warms
    whole = Block.of(t, acc)
    assert common_samples(whole, reference()) is whole, "there is no other triad"
    gyr[odd == 0] = 0.0
    gyr[300] = np.nan
    lost = Block.of(t, acc, gyr)
    assert common_samples(lost, reference()) is lost, "a lost sample is a gap"


def warmed(t: Array, temperature: Array) -> Experience:
    block = replace(Block.of(t, course(t)[:, :3]), temperature=temperature)
    there = rows_in_motion(block, reference(), STILL, 2, 2.0, 1.0)
    return there.experience(there.acc)


def test_rows_end_at_gaps_of_recording_and_reference() -> None:
    t = np.arange(0.0, 30.0, 0.02)
    whole = Block.of(t, course(t)[:, :3], course(t)[:, 3:])
    holey = Block(*(v[(t < 10) | (t > 11)] for v in
                    (whole.t, whole.acc, whole.gyr, whole.temperature, whole.seq,
                     whole.t_host)))  # fmt: skip
    for block, beside in ((holey, whole), (whole, holey)):
        there = rows_in_motion(block, Reference(beside), STILL, 1, 2.0, 1.0)
        inside = there.t.ravel()
        assert not ((inside > 10.01) & (inside < 10.99)).any()
        stretches = inside.reshape(-1, there.length)
        assert (np.ptp(stretches, axis=1) < 2.0).all()
        assert inside.min() > 1.0 and inside.max() < 29.0


def test_a_channel_that_the_reference_lacks_is_none_of_its_own() -> None:
    t = np.arange(0.0, 20.0, 0.02)
    acc = course(t)[:, :3].copy()
    acc[:, 1] = np.nan
    found = Reference(Block.of(t, acc))
    assert found.observed.tolist() == [True, False, True, False, False, False]
    assert not found.at(t[50:60])[:, 1].any()
