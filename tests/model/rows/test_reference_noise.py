"""What noise of a reference hides, beside Wiener filters of known spectra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.reference import Reference
from fieldcal.model.rows.reference_noise import ReferenceNoise

HZ, COUNT, POLE = 50.0, 20_000, 0.9
TURN = np.linalg.qr(np.arange(9.0).reshape(3, 3) + np.eye(3))[0]
"""Of the axes along which the motion has one spectrum each."""


def motion(rng: np.random.Generator, sizes: Array) -> Array:
    """Motion of first order along turned axes, (n, 3)."""
    driven = sizes * rng.standard_normal((COUNT, 3))
    out: Array = lfilter([1.0], [1.0, -POLE], driven, axis=0) @ TURN.T
    return out


def reference(acc: Array, gyr: Array) -> Reference:
    return Reference(Block.of(np.arange(COUNT) / HZ, acc, gyr))


def wiener(z: Array, sizes: Array, variance: float) -> Array:
    """Expected motion beside z, with the spectra known and the recording as a ring."""
    turn = np.exp(2j * np.pi * np.fft.rfftfreq(COUNT))[:, None]
    power = sizes**2 / np.abs(turn - POLE) ** 2
    spectrum = np.fft.rfft(z @ TURN, axis=0) * power / (power + variance)
    out: Array = np.fft.irfft(spectrum, COUNT, axis=0) @ TURN.T
    return out


def test_what_is_hidden_is_what_a_wiener_filter_takes_away() -> None:
    rng = np.random.default_rng(1)
    sizes, sigma = np.array([0.02, 0.05, 0.1]), 0.06
    u = motion(rng, sizes)
    z = u + sigma * rng.standard_normal(u.shape)
    noise = ReferenceNoise.of(reference(z + [0.0, 0.0, 9.8], 1e-3 * z))
    away = noise.hidden.at(np.arange(COUNT) / HZ)
    right = z - wiener(z, sizes, sigma**2)
    inner = slice(250, -250)
    for triad, scale in ((slice(0, 3), 1.0), (slice(3, 6), 1e-3)):
        variance = noise.variance[triad.start // 3]
        told = sigma**2 * scale**2 / variance * away[inner, triad]
        left = np.std(told - scale * right[inner]) / np.std(scale * right)
        assert left < 0.1


def test_a_regression_on_it_gives_the_noise_of_the_reference_and_no_filter() -> None:
    found = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        u = motion(rng, np.array([0.02, 0.05, 0.1]))
        z = u + 0.06 * rng.standard_normal(u.shape)
        noise = ReferenceNoise.of(reference(z, z))
        away = noise.hidden.at(np.arange(COUNT) / HZ)[:, :3]
        columns = np.column_stack([z.ravel(), away.ravel()])
        scale, share = np.linalg.lstsq(columns, u.ravel(), rcond=None)[0]
        found.append((scale, -share * noise.variance[0] / 0.06**2))
    scales, variances = np.array(found).T
    assert np.abs(scales - 1).max() < 0.01
    assert np.abs(variances - 1).max() < 0.06


def test_the_noise_is_at_most_the_weakest_motion() -> None:
    rng = np.random.default_rng(2)
    z = motion(rng, np.full(3, 0.05))
    noise = ReferenceNoise.of(reference(z, z))
    # at the highest frequency a motion of first order has so much
    assert noise.variance[0] == pytest.approx((0.05 / (1 + POLE)) ** 2, rel=0.2)


def test_beside_a_motion_without_noise_next_to_nothing_is_hidden() -> None:
    t = np.arange(COUNT) / HZ
    slow = np.sin(2 * np.pi * np.outer(t, [0.3, 0.5, 0.7]))
    noise = ReferenceNoise.of(reference(slow, slow))
    away = noise.hidden.at(t)[250:-250]
    assert np.std(away) < 1e-3 * np.std(slow)


def test_a_triad_that_moves_about_one_axis_and_one_that_is_missing() -> None:
    rng = np.random.default_rng(3)
    about = motion(rng, np.array([0.0, 0.0, 0.1])) @ TURN
    gyr = np.full((COUNT, 3), np.nan)
    gyr[:, 2] = about[:, 2] + 0.05 * rng.standard_normal(COUNT)
    noise = ReferenceNoise.of(reference(np.full((COUNT, 3), np.nan), gyr))
    away = noise.hidden.at(np.arange(COUNT) / HZ)
    assert noise.variance[0] == 0.0
    assert not away[:, :5].any()
    columns = np.column_stack([gyr[:, 2], away[:, 5]])
    scale, share = np.linalg.lstsq(columns, about[:, 2], rcond=None)[0]
    assert scale == pytest.approx(1.0, abs=0.01)
    assert -share * noise.variance[1] == pytest.approx(0.05**2, rel=0.2)
