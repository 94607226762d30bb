"""What is cut toward zero, as an autopilot cuts it: means with an error that holds."""

import numpy as np
import pytest

from fieldcal.core.errors import Moved
from fieldcal.core.samples import Array, Block, Grain
from fieldcal.windows import Average, average

STEP = np.repeat([9.80665e-3, 1e-3], 3)
CUT = Grain(STEP[0], STEP[3], cut=True)
ROUNDED = Grain(STEP[0], STEP[3])
SEEDS, N = 25, 1500


def window(values: Array, grain: Grain | None) -> Average:
    t = np.arange(N) / 50
    return average(Block.of(t, values[:, :3], values[:, 3:]), grain=grain)


def pulls(noise: float, centre: float, grain: Grain) -> tuple[Array, int]:
    """Errors over their stated size, and how many windows were taken for disturbed."""
    rng, found, moved = np.random.default_rng(5), [], 0
    for _ in range(SEEDS):
        v = centre + rng.uniform(-2, 2, 6)
        x = v + noise * rng.standard_normal((N, 6))
        k = np.trunc(x) + 0.5 * np.sign(np.trunc(x)) if grain.cut else np.rint(x)
        try:
            seen = window(k * STEP, grain)
        except Moved:
            moved += 1
            continue
        found.append((seen.mean / STEP - v) / (seen.sigma / STEP))
    return np.array(found), moved


@pytest.mark.statistical
@pytest.mark.parametrize("grain", [CUT, ROUNDED], ids=["cut", "rounded"])
@pytest.mark.parametrize("centre", [0.0, 1000.0])
@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3, 0.6, 1.0, 3.0])
def test_the_error_of_a_mean_holds_however_little_noise(
    noise: float, centre: float, grain: Grain
) -> None:
    z, moved = pulls(noise, centre, grain)
    assert moved <= 2
    # where hardly anything varies, no window tells how little: the error is on the safe
    # side, at most five times what it is
    assert 0.2 < np.sqrt(np.mean(z**2)) < 1.35
    assert np.abs(z).max() < 5


def test_a_push_of_a_few_steps_is_still_seen() -> None:
    rng = np.random.default_rng(1)
    values = np.rint(rng.normal(0, 0.3, (N, 6)))
    values[700:720, 1] += 4
    with pytest.raises(Moved, match="disturbed 1[34]"):
        window(values * STEP, ROUNDED)


def test_a_device_that_says_nothing_is_judged_by_what_is_seen() -> None:
    rng = np.random.default_rng(2)
    values = rng.normal(0, 1e-3, (N, 6))
    one, other = window(values, None), window(values, Grain())
    np.testing.assert_array_equal(one.covariance, other.covariance)
