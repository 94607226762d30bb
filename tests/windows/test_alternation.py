"""Two devices whose samples come by turns, and single ones that look like two."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.windows.alternation import alternating_means

N = 200
NOISE = np.array([0.02, 0.03, 0.02, 1e-3, 1e-3, 2e-3])
AT_REST = np.array([0.1, -9.6, 0.3, 0.01, -0.02, 0.005])


def one_device(seed: int, n: int = N) -> Array:
    rng = np.random.default_rng(seed)
    return np.asarray(AT_REST + NOISE * rng.standard_normal((n, 6)))


def turns(how: str) -> NDArray[np.bool_]:
    """Which samples are of the second device."""
    k = np.arange(N)
    some: dict[str, NDArray[np.bool_]] = {
        "in turn": k % 2 == 1,
        "in bursts": k // 5 % 2 == 1,
        "one four times as quick": k % 5 != 0,
        "at random": np.random.default_rng(5).random(N) < 0.5,
    }
    return some[how]


OTHERS = {
    "one bias and its neighbour": [10.0, 8.0, 0, 0, 0, 0],
    "all outputs a little": [3.0, -3.0, 3.0, 3.0, 3.0, -3.0],
    "gyroscopes only": [0, 0, 0, 12.0, -9.0, 0],
}


@pytest.mark.parametrize("how", ["in turn", "in bursts", "at random"])
@pytest.mark.parametrize("what", OTHERS)
def test_two_devices_are_found_with_their_difference(how: str, what: str) -> None:
    apart = NOISE * OTHERS[what]
    found = alternating_means(one_device(1) + turns(how)[:, None] * apart)
    assert found is not None
    sign = np.sign(found.apart @ apart)
    assert np.abs(sign * found.apart - apart).max() < 0.5 * NOISE.max()
    assert np.allclose(found.noise, NOISE, rtol=0.3)


def test_outputs_that_do_not_differ_blur_nothing() -> None:
    """Two of six tell them apart, far beyond their noise, and by chance others lean."""
    apart = NOISE * [3000.0, 1.5, 3000.0, 0.2, 0.2, 0.2]
    for seed in range(40):
        found = alternating_means(one_device(seed) + turns("in turn")[:, None] * apart)
        assert found is not None, seed
        assert np.allclose(found.noise, NOISE, rtol=0.3), seed


def test_rates_may_differ() -> None:
    apart = NOISE * OTHERS["one bias and its neighbour"]
    mixed = one_device(2) + turns("one four times as quick")[:, None] * apart
    assert alternating_means(mixed) is not None


def test_outputs_that_are_not_there_do_not_count() -> None:
    mixed = one_device(3) + turns("in turn")[:, None] * NOISE * 10.0
    mixed[:, 3:] = np.nan
    found = alternating_means(mixed)
    assert found is not None and (found.apart[3:] == 0).all()
    assert (np.abs(found.apart[:3]) > 0.1).all()


def rounded(seed: int) -> Array:
    """Noise below the step: each output is one of two values, each by itself."""
    return np.asarray(np.round(one_device(seed) / (4 * NOISE)) * 4 * NOISE)


def shaken_and_rounded() -> Array:
    """One vibration makes two rounded outputs jump together."""
    shaken = one_device(6)
    shaken[:, :2] += np.where(turns("at random"), 0.3, -0.3)[:, None]
    return np.round(shaken / 0.5 + 0.5) * 0.5


SINGLE = {
    "noise": one_device(4),
    "rounded": rounded(1),
    "rounded otherwise": rounded(2),
    "shaken and rounded": shaken_and_rounded(),
    "moved half way": one_device(5) + (np.arange(N) > N / 2)[:, None] * NOISE * 20,
    "a hum": one_device(6) + np.sin(0.7 * np.arange(N))[:, None] * NOISE * 20,
    "wrong bits": one_device(7)
    + np.outer(turns("at random"), [0, 0, 0, 0, 0.2, 0]) * 1.0,
    "one wild sample in fifty": one_device(8)
    + (np.arange(N) % 50 == 0)[:, None] * NOISE * 90,
    "nothing": np.full((N, 6), np.nan),
    "stuck": np.tile(AT_REST, (N, 1)),
    "few": one_device(9)[:20] + turns("in turn")[:20, None] * NOISE * 10.0,
}


@pytest.mark.parametrize("what", SINGLE)
def test_one_device_is_not_taken_for_two(what: str) -> None:
    assert alternating_means(SINGLE[what]) is None


def test_chance_does_not_make_two_of_one() -> None:
    for seed in range(200):
        assert alternating_means(one_device(seed)) is None
        assert alternating_means(rounded(seed)) is None
