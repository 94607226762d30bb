"""Rails: what stops at full scale, and what gravity makes as much up as down."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Block
from fieldcal.effects.saturation import Saturation, samples_at_rails
from fieldcal.physics.experience import Experience
from fieldcal.physics.recording import CheckedSamples, Grids, lsb_of

STEP = 1e-3


def box(seed: int, noise: float) -> np.ndarray:
    """An axis laid up, down and level, with hardly a bias, on a grid of values."""
    rng = np.random.default_rng(seed)
    held = np.repeat([9.79, 0.0, -9.79, 6.92, -6.92], 1000)
    return np.round((held + rng.normal(0, noise, len(held))) / STEP) * STEP


def test_gravity_as_much_up_as_down_is_no_full_scale() -> None:
    """Noise of a few steps takes the outermost values more than once, by chance."""
    alike = 0
    for seed in range(400):
        values = box(seed, 1.2 * STEP)
        alike += abs(values.max() + values.min()) < 1e-3 * values.max()
        assert not samples_at_rails(values, np.nan)
    assert alike > 300


@pytest.mark.parametrize("seed", range(5))
def test_what_is_clipped_as_far_down_as_up_is_found(seed: int) -> None:
    values = np.clip(box(seed, 3 * STEP), -9.789, 9.789)
    found = samples_at_rails(values, np.nan)
    assert len(found) == 2
    for at in found:
        assert set(np.abs(values[at])) == {9.789}
        assert len(at) > 300


def test_the_declared_range_needs_no_more_than_a_few() -> None:
    values = np.concatenate([np.linspace(-1.0, 8.0, 500), np.full(5, 9.8)])
    assert [len(at) for at in samples_at_rails(values, 9.8)] == [5]
    assert not samples_at_rails(values, 19.6)


def test_a_coarse_step_is_known_though_the_first_rest_shows_two_values() -> None:
    """A device on one face for minutes: its other positions show the grid."""
    rng = np.random.default_rng(3)
    held = np.repeat([9.79, 0.0, -9.79, 6.92, -6.92], 22_000)
    step = 0.037
    values = np.round((held + rng.normal(0, 0.2 * step, len(held))) / step) * step
    assert len(np.unique(values[:20_000])) == 2
    assert lsb_of(values) == pytest.approx(step, rel=1e-9)
    assert samples_at_rails(values, np.nan) and not samples_at_rails(
        values, np.nan, coarse=True
    )


def swung(at: float, seconds: float = 1.0) -> np.ndarray:
    """A rate at rest, and in turns of which the largest goes beyond a stop once."""
    rng = np.random.default_rng(8)
    t = np.arange(0, 40, 0.01)
    rate = 1.2 * np.exp(-(((t - 12) / 0.5) ** 2)) - np.exp(-(((t - 20) / 0.6) ** 2))
    rate += 5.5 * np.exp(-(((t - 30) / seconds) ** 2))
    return np.minimum(np.round((rate + rng.normal(0, 1e-3, len(t))) / 1e-4) * 1e-4, at)


def test_a_turn_that_runs_into_the_stop_once_is_clipped() -> None:
    """A single fast turn of a hobby gyroscope at 250 deg/s."""
    (at,) = samples_at_rails(swung(4.3633), np.nan)
    assert len(at) > 50 and np.ptp(at) == len(at) - 1
    assert not samples_at_rails(swung(9.0), np.nan)
    # nor is it known of one that begins or ends there
    values = swung(4.3633)
    assert not samples_at_rails(values[at[0] :], np.nan) and not samples_at_rails(
        values[: at[-1]], np.nan
    )


def test_what_stands_still_on_the_way_up_is_at_no_stop() -> None:
    """The largest value, taken again and again: but it goes on with a jump."""
    values = swung(9.0)
    top = int(np.argmax(values))
    values[top - 30 : top + 60] = values[top - 30]
    assert values.max() == values[top]
    assert not samples_at_rails(values, np.nan)


def leaning(limit: float, steps: float = 1e-4, dead: bool = False) -> CheckedSamples:
    """A device of which y is up all the time, and x in its last position."""
    rng = np.random.default_rng(4)
    n = 3000
    angle = np.interp(np.arange(n), [0, 900, 1000, 1900, 2000], [0, 0, 0.6, 0.6, 0.75])
    force = 9.8 * np.column_stack([np.sin(angle), -np.cos(angle) - 0.3, 0 * angle])
    noise = np.array([0.01, 0.01, 0.01])
    acc = np.clip(force + rng.normal(0, noise, (n, 3)), -limit, limit)
    acc = np.round(acc / steps) * steps
    if dead:
        acc[:, 1:] = 0.0
    gyr = rng.normal(0, 1e-3, (n, 3))
    nowhere = np.full(1, np.nan)
    return CheckedSamples(
        Block.of(np.arange(n) / 50.0, acc, gyr), np.array([[0, 900]]),
        Experience.at_rest(nowhere, nowhere, 9.8), np.ones(6), np.zeros(6),
        np.array([0.01, 0.0, 0.01, *[1e-3] * 3]), np.full(6, 0.01), np.full(6, steps),
        Grids(np.zeros(1, np.intp), np.array([[steps] * 3 + [0.0] * 3])),
        np.full(2, np.nan), 50.0,
    )  # fmt: skip


def test_two_axes_that_stop_at_one_value_are_at_their_full_scale() -> None:
    """Neither comes out of it before the recording ends."""
    found = {f.channel: f for f in Saturation().find(leaning(6.5))}
    assert set(found) == {"ax", "ay"}
    for fault in found.values():
        assert fault.values["limit"] == pytest.approx(6.5)
        assert fault.sigmas["limit"] == 0.01
    assert len(found["ay"].rows) == 3000 and 900 < len(found["ax"].rows) < 1100


def test_one_axis_alone_may_be_stuck_there() -> None:
    assert not Saturation().find(leaning(9.0))
    assert not Saturation().find(leaning(6.5, steps=0.1)), "any value is taken again"
    assert not Saturation().find(leaning(9.0, dead=True)), "two that are never sent"
