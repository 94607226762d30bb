"""Outputs that the device sets to zero as long as they are small."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.windows.dead_band import (
    dead_band_messages,
    dead_bands,
    error_of_means,
)

BAND = 0.05


def swung(seed: int) -> Array:
    """Three axes that swing through zero at different speeds, with some noise."""
    t, rng = np.arange(0, 60, 0.01), np.random.default_rng(seed)
    swing = [np.sin(2 * np.pi * t / p + rng.uniform(0, 6)) for p in (9.0, 13.0, 17.0)]
    out: Array = 2 * np.column_stack(swing) + rng.normal(0, BAND / 10, (len(t), 3))
    return out


def banded(values: Array) -> Array:
    return np.where(np.abs(values) < BAND, 0.0, values)


def of_triads(acc: Array, gyr: Array) -> Array:
    return dead_bands(Block.of(np.arange(len(acc)) / 100.0, acc, gyr))


def test_each_output_has_its_own() -> None:
    acc, gyr = swung(3), swung(4)
    gyr[:, 1] = banded(gyr[:, 1])
    np.testing.assert_allclose(
        of_triads(banded(acc), gyr), [*[BAND] * 3, 0, BAND, 0], rtol=0.02
    )


@pytest.mark.parametrize(
    ("bias", "noise"), [(0.0, 0.4), (0.4, 0.4), (1.3, 0.4), (0.0, 0.02), (0.9, 0.02)]
)
def test_gyroscopes_that_rest_and_turn_once_show_it(bias: float, noise: float) -> None:
    """Also those whose noise never reaches beyond it, so that all are zero at rest."""
    rng = np.random.default_rng(6)
    gyr = BAND * (bias + noise * rng.standard_normal((3000, 3)))
    gyr[1000:2000] += 0.7 * np.sin(np.linspace(0, np.pi, 1000))[:, None]
    found = of_triads(swung(1)[:3000], banded(gyr))[3:]
    np.testing.assert_allclose(found, BAND, rtol=0.06)


def test_axes_that_each_turn_too_quickly_show_their_band_together() -> None:
    """A log of ten rows a second has a row of each axis just beyond it, if any."""
    shown = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        angle = np.pi * np.clip(np.arange(700) % 70 - 50, 0, 20) / 20
        rate = rng.choice([-1, 1], 10).repeat(70) * np.sin(angle) ** 2
        gyr = rate[:, None] * np.eye(3)[rng.integers(0, 3, 10)].repeat(70, axis=0)
        gyr += BAND * (0.4 + 0.1 * rng.standard_normal((700, 3)))
        found = dead_bands(Block.of(np.arange(700) / 10, swung(1)[:700], banded(gyr)))
        shown += bool((found[3:] > 0).all())
        assert (found[3:] < 2 * BAND).all()
    assert shown > 15


def test_a_mean_is_as_uncertain_as_what_the_band_takes_from_it() -> None:
    """Also where only a part of the samples is in the band."""
    rng = np.random.default_rng(3)
    true = np.linspace(-3 * BAND, 3 * BAND, 61)
    samples = true[:, None] + rng.normal(0, 0.3 * BAND, (61, 4000))
    mean = banded(samples).mean(axis=1)
    sigma = error_of_means(mean[:, None], np.array([BAND]))[:, 0]
    assert (np.abs(mean - true) < 2 * sigma + 0.01 * BAND).all()
    assert not sigma[[0, -1]].any() and sigma[30] == pytest.approx(BAND / 3**0.5)


def test_what_is_zero_for_another_reason_is_no_dead_band() -> None:
    lost, smooth = swung(4), swung(5)
    lost[100:120] = 0.0
    coarse = np.round(smooth / BAND) * BAND
    told = np.round(coarse, 3)  # a grid as a text of few digits has it
    # cut, and not rounded, to those digits: a step is 0.017 forth and 0.018 back
    cut = np.floor(np.round(smooth / 0.0175) * 17.5) / 1e3
    sparse = np.where(np.arange(len(smooth))[:, None] % 7, coarse, np.nan)
    for some in (smooth, lost, coarse, told, cut, sparse, np.zeros_like(smooth)):
        assert not of_triads(some, some).any()


def test_the_operator_reads_which_outputs_hide_what() -> None:
    """Each triad in its unit; not where no window measured as little as that."""
    acc, gyr = banded(swung(3)), swung(4)
    gyr[:, 1] = 0.4 * banded(gyr[:, 1])
    acc[7], gyr[7, 1] = BAND, 0.4 * BAND
    block = Block.of(np.arange(len(acc)) / 100.0, acc, gyr)
    means = np.array([[0.0, 3.0, 9.0, 0.0, 0.5, 0.0], [9.0, 3.0, 0.02, 1.0, 0.5, 1.0]])
    (line,) = dead_band_messages(block, means)
    assert line.startswith("ax and az are zero where less than 0.05 m/s² is measured")
    means[:, :3] = 9.0
    assert list(dead_band_messages(block, means)) == []
    means[1, 4] = -0.03
    (line,) = dead_band_messages(block, means)
    assert line.startswith("gy is zero where less than 0.02 rad/s is measured")


@pytest.mark.parametrize(("zeros", "lost", "found"),
                         [(2, 0, True), (1, 3, False), (2, 3, True)])  # fmt: skip
def test_two_zeros_that_were_received_show_a_band(
    zeros: int, lost: int, found: bool
) -> None:
    """Of gyroscopes where any channel arrived, of accelerometers where gravity did."""
    values = np.tile([1.0, 1.3, 1.5, -1.4, 3.0, -8.0], 4)[:, None] * BAND
    acc, gyr = values * np.ones(3), 0.7 * values * np.ones(3)
    acc[:zeros, 1] = gyr[5 : 5 + zeros, 2] = 0.0
    acc[10 : 10 + lost] = gyr[10 : 10 + lost] = 0.0
    expected = np.zeros(6)
    if found:
        expected[[1, 5]] = BAND, 0.7 * BAND
    np.testing.assert_allclose(of_triads(acc, gyr), expected)
