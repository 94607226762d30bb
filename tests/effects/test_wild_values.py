"""Wild values of single samples, looked for in pieces of a recording."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import ACC, GYR, Array, Block
from fieldcal.effects import decode_fault
from fieldcal.physics.experience import Experience
from fieldcal.physics.recording import CheckedSamples, Grids


def at_rest(six: Array) -> CheckedSamples:
    """Samples of one window, on no grid."""
    n, none = len(six), np.zeros(6)
    nowhere: Array = np.full(1, np.nan)
    return CheckedSamples(
        Block.of(np.arange(n) / 100.0, six[:, ACC], six[:, GYR]), np.array([[0, n]]),
        Experience.at_rest(nowhere, nowhere, 9.8), np.ones(6), none, none, none, none,
        Grids(np.zeros(1, np.intp), none[None]), np.full(2, np.nan), 100.0,
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(20))
def test_a_piece_without_far_values_need_not_be_looked_at(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(seed)
    six = rng.normal(0.0, np.repeat([0.05, 0.005], 3), (4000, 6))
    at = rng.integers(20, 3980, 12)
    six[at, rng.integers(0, 6, 12)] += rng.choice([0.3, 3.0, 6.0, 60.0], 12)
    six[rng.integers(0, 4000, 3), 4] = np.nan
    monkeypatch.setattr(decode_fault, "SAMPLES_AT_ONCE", 100)
    monkeypatch.setattr(decode_fault, "AROUND", 50)
    quick = decode_fault._outlier_samples(at_rest(six))
    monkeypatch.setattr(decode_fault, "_lie_within", lambda _block, _most: False)
    np.testing.assert_array_equal(quick, decode_fault._outlier_samples(at_rest(six)))
    assert quick.any()
    assert not quick.all(axis=1).any()
