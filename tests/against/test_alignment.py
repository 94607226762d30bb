"""Where a recording stands beside a reference, of motions drawn at random."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from fieldcal.against.motion.alignment import align_motion
from fieldcal.against.motion.correlation import explained_score, lag_scores
from fieldcal.against.motion.grid import GRID_HZ, EvenGrid
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block

HZ, N, G = 100.0, 10_000, 9.8
NAMES = ("recording", "simulator")

Values = NDArray[np.floating]


def motion(seed: int) -> Values:
    """Forces and rates of a body that stands upright, (n, 6)."""
    rng = np.random.default_rng(seed)
    six: Values = 20 * gaussian_filter1d(rng.standard_normal((N, 6)), 30, axis=0)
    six[:, 1] -= G
    return six


def block(t: Values, six: Values) -> Block:
    return Block.of(t, six[:, :3], six[:, 3:])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("lost", [None, 1, 4])
def test_delay_drift_and_axes_are_those_that_were_drawn(
    seed: int, lost: int | None
) -> None:
    rng = np.random.default_rng(100 + seed)
    late, start, drift = int(rng.integers(100, 900)), 7.0, 1e-4
    turn = Rotation.random(random_state=seed).as_matrix()
    sim, t = motion(seed), np.arange(N) / HZ
    real = np.hstack([sim[:, :3] @ turn.T, sim[:, 3:] @ turn.T])[late:]
    real += rng.normal(0, 0.01, real.shape)
    if lost is not None:
        sim[:, lost] = np.nan
    found = align_motion(
        block(t[:-late], real), block(start + t * (1 + drift), sim), NAMES
    )
    where = found.alignment
    true = start + (late / HZ + where.middle) * (1 + drift)
    assert where.middle - where.delay == pytest.approx(true, abs=0.02)
    off = Rotation.from_matrix(where.rotation @ turn.T).magnitude()
    assert off < 0.03
    assert where.drift == pytest.approx(drift, abs=3e-4)
    expected = np.zeros(6)
    if lost == 1:  # what stands upright is known of the recording
        expected[1] = -G
    np.testing.assert_allclose(where.unseen_gravity, expected, atol=0.5)
    assert found.hz.shape == (6,)


def test_what_a_shift_explains_is_the_share_of_a_regression() -> None:
    """Shift by shift, by least squares and not by correlations."""
    six, t = motion(5), np.arange(N) / HZ
    one = EvenGrid.of(block(t[:4000], six[300:4300]))
    two = EvenGrid.of(block(t[:6000], six[:6000, [1, 2, 0, 5, 3, 4]]))
    lags, told = lag_scores(one, two)
    assert lags[np.argmax(told.sum(axis=1))] == -300 / HZ * GRID_HZ
    for lag in (-75, -60, -10, 0):  # in steps of the grid
        z = two.six[-lag : -lag + len(one)]
        for j, triad in enumerate(np.repeat([[0, 1, 2], [3, 4, 5]], 3, axis=0)):
            x, y = one.six[:, triad], z[:, j]
            left = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
            said = -np.log(max(float((left @ left) / (y @ y)), 1e-6))
            assert told[lags == lag, j] == pytest.approx(said, rel=1e-6, abs=1e-9)
        assert explained_score(one.six, z) == pytest.approx(
            float(told[lags == lag].sum())
        )


def test_no_alignment_without_a_motion_in_common() -> None:
    t = np.arange(N) / HZ
    real, other = block(t, motion(1)), block(t, motion(2))
    with pytest.raises(InputError, match="show no common motion"):
        align_motion(real, other, NAMES)
    acc, gyr = motion(1), motion(1)
    acc[:, 3:], gyr[:, :3] = np.nan, np.nan
    with pytest.raises(InputError, match="no moving triad in common"):
        align_motion(block(t, acc), block(t, gyr), NAMES)
