"""Samples that are off by one size, found axis by axis."""

import numpy as np
import pytest

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array, Mask
from fieldcal.physics import torn_values as torn
from fieldcal.physics.torn_values import torn_values


def _of_whole_arrays(triad: Array, still: Mask, steps: Array) -> tuple[float, Array]:
    """The same as `torn_values`, of all samples at once; size 0 without any."""
    nothing = 0.0, np.zeros_like(triad)
    apart, departs = np.zeros_like(triad), np.zeros_like(triad)
    apart[1:-1] = np.abs(triad[1:-1] - (triad[:-2] + triad[2:]) / 2)
    apart[~still | ~np.isfinite(apart).all(axis=1)] = 0.0
    noise = np.array([MAD_TO_SIGMA * np.median(a[a > 0]) for a in apart.T])
    about = np.stack([triad[i : len(triad) - 4 + i] for i in range(5)])
    departs[2:-2] = np.nan_to_num(triad[2:-2] - np.median(about, axis=0))
    departs[apart <= torn.BEYOND_NOISE / 2 * noise] = 0.0
    far = np.abs(departs) > torn.BEYOND_NOISE * noise
    if far.sum() < torn.FEWEST:
        return nothing
    size = float(np.median(np.abs(departs[far])))
    alike = far & (np.abs(np.abs(departs) - size) < torn.AS_LARGE * noise)
    axes, many = far.any(axis=0), alike.sum()
    up, hit = (departs > 0)[alike], alike.any(axis=1).sum()
    good = (
        size > (torn.BEYOND_NOISE + torn.AS_LARGE) * noise[axes].max()
        and size >= torn.FINEST * steps[axes].max()
        and many >= max(torn.FEWEST, (1 - torn.MOST_OTHERS) * far.sum())
        and up.any()
        and not up.all()
        and many <= (1 + torn.MOST_OTHERS) * hit
    )
    return (size, np.where(alike, np.sign(departs) * size, 0.0)) if good else nothing


@pytest.mark.parametrize("seed", range(40))
def test_piece_by_piece_is_what_the_whole_arrays_give(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(900, 1500))
    triad, still = rng.standard_normal((n, 3)), rng.random(n) > 0.05
    hit = (rng.random((n, 3)) < 0.02) * rng.choice([-1.0, 1.0], (n, 3))
    triad += hit * rng.choice([3.0, 8.0, 40.0]) * (np.arange(3) < rng.integers(1, 4))
    if seed % 4 == 1:  # together on all axes
        triad[::40] += 40.0 * (-1.0) ** np.arange(len(triad[::40]))[:, None]
    if seed % 3 == 0:
        triad[rng.random(n) < 0.01, 1] = np.nan
    steps = np.full(3, rng.choice([0.0, 0.01, 0.5]))
    monkeypatch.setattr(torn, "SAMPLES_AT_ONCE", 64)
    found, (size, off) = (
        torn_values(triad, still, steps),
        _of_whole_arrays(triad, still, steps),
    )
    assert (found.size if found else 0.0) == size
    np.testing.assert_array_equal(found.off if found else np.zeros_like(off), off)


def test_both_answers_are_among_the_cases() -> None:
    rng, still = np.random.default_rng(0), np.ones(1000, dtype=bool)
    triad = rng.standard_normal((1000, 3))
    assert torn_values(triad, still, np.zeros(3)) is None
    triad[10:990:20, 0] += np.resize([40.0, -40.0], 49)
    found = torn_values(triad, still, np.zeros(3))
    assert found is not None
    assert abs(found.size - 40.0) < 1.0
    assert np.flatnonzero(found.off.any(axis=1)).tolist() == list(range(10, 990, 20))
