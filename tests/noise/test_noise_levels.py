"""Powers of levels, taken in one pass."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import dct

from fieldcal.noise.levels import (
    FOLDS,
    KEPT,
    SEGMENT,
    CosineLevels,
    neighbour_differences,
    octave_bins,
)
from fieldcal.noise.measured import measured_allan_deviation


def test_it_does_not_matter_how_samples_come() -> None:
    values = np.random.default_rng(1).standard_normal((140_000, 2))
    whole, parts = CosineLevels(0.1, 2, 1), CosineLevels(0.1, 2, 1)
    whole.add(values)
    for part in np.split(values, [1, 700, 701, 17_000, 17_001, 139_990]):
        parts.add(part)
    one, other = whole.reduced(), parts.reduced()
    assert one.samples == other.samples == 140_000
    assert one.means == pytest.approx(other.means, abs=1e-12)
    assert one.squares == pytest.approx(other.squares)
    assert one.number.tolist() == other.number.tolist()
    for a, b in zip(one.levels, other.levels, strict=True):
        assert a.power == pytest.approx(b.power)
        assert (a.number == b.number).all()


def test_powers_of_a_level_are_those_of_its_stretches() -> None:
    values = np.random.default_rng(2).standard_normal((KEPT + 1, 1))
    levels = CosineLevels(1.0, 1, 1)
    levels.add(values)
    below = levels.reduced().levels[0]
    stretches = values[: 16 * SEGMENT].reshape(16, SEGMENT) - values[0]
    squares = dct(stretches, norm="ortho", axis=1) ** 2
    for fold in range(FOLDS):
        for i, (first, end) in enumerate(
            zip(below.edges, below.edges[1:], strict=False)
        ):
            expected = squares[fold::FOLDS, first:end].sum()
            assert below.power[i, fold, 0] == pytest.approx(expected)


def test_a_short_recording_is_kept_whole() -> None:
    values = np.arange(20.0).reshape(10, 2)
    levels = CosineLevels(1.0, 2, 2)
    levels.add(values)
    found = levels.reduced()
    assert found.m == 1 and not found.levels
    assert found.means + found.origin == pytest.approx(values)


def test_memory_does_not_grow_with_length() -> None:
    levels = CosineLevels(0.01, 1, 1)
    for _ in range(20):
        levels.add(np.zeros((1 << 16, 1)))
    found = levels.reduced()
    assert len(found.means) <= KEPT and found.m == 512


@given(st.integers(1, 200), st.integers(2, 3000))
def test_bins_cover_all_coefficients_once(first: int, more: int) -> None:
    edges = octave_bins(first, first + more)
    assert edges[0] == first and edges[-1] == first + more
    assert (np.diff(edges) > 0).all()


def test_measured_deviations_are_those_of_allantools() -> None:
    tools = pytest.importorskip("allantools")
    values = np.random.default_rng(3).standard_normal((60_000, 1)).cumsum(axis=0)
    levels = CosineLevels(0.01, 2, 1)
    levels.add(np.hstack([values, np.zeros_like(values)]))
    found = measured_allan_deviation([levels.reduced()], 0)
    m = np.round(found.tau / 0.01).astype(int)
    expected = [
        # overlapping by means, not by samples
        np.sqrt(np.mean(neighbour_differences(_means(values, 8), int(k) // 8) ** 2) / 2)
        for k in m
    ]
    assert found.deviation == pytest.approx(np.array(expected))
    theirs = tools.oadev(values[:, 0], 100.0, "freq", found.tau)[1]
    assert found.deviation == pytest.approx(theirs, rel=0.05)


def _means(values: np.ndarray, m: int) -> np.ndarray:
    return np.asarray(values[: len(values) // m * m].reshape(-1, m).mean(axis=1))[
        :, None
    ]
