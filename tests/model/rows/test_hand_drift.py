"""How far a hand drifts, told from recordings in which it turns in known ways."""

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.rows.hand_drift import ForceTurn, drift_factor, force_turn_rate

RATE, SECONDS, G = 100.0, 6.0, 9.81
T = np.arange(0.0, SECONDS, 1 / RATE)


def force(angle: Array, noise: float, rng: np.random.Generator) -> Array:
    """Specific force of a device that is turned by small angles (n, 3), rad."""
    up = np.array([0.36, 0.48, 0.8])
    return G * (up - np.cross(angle, up)) + rng.normal(0.0, noise, angle.shape)


def test_an_even_turn_is_seen_about_both_axes_across_gravity() -> None:
    """(2), with the rate's part about gravity unseen."""
    rng, rate = np.random.default_rng(1), np.array([3e-3, -1e-3, 2e-3])
    up = np.array([0.36, 0.48, 0.8])
    across = rate - up * (rate @ up)
    told = force_turn_rate(force(np.outer(T, rate), 0.0, rng), SECONDS)
    assert told.square == pytest.approx(across @ across / 2, rel=0.01)
    assert told.noise < 1e-12


def test_of_a_device_at_rest_what_is_seen_is_noise() -> None:
    rng = np.random.default_rng(2)
    still = [force_turn_rate(force(np.zeros((len(T), 3)), 0.05, rng), SECONDS)
             for _ in range(2000)]  # fmt: skip
    square, noise = np.mean(still, axis=0)
    assert square == pytest.approx(noise, rel=0.1)


def test_samples_that_are_missing_change_nothing_else() -> None:
    rng = np.random.default_rng(3)
    acc = force(np.outer(T, [2e-3, 0.0, 0.0]), 1e-4, rng)
    whole = force_turn_rate(acc, SECONDS)
    acc[50:150, 1] = np.nan
    assert force_turn_rate(acc, SECONDS).square == pytest.approx(whole.square, rel=0.02)
    acc[5:] = np.nan
    assert force_turn_rate(acc, SECONDS) == ForceTurn(0.0, np.inf)


def hands(kind: str, seed: int) -> tuple[list[ForceTurn], Array]:
    """Forty windows of a hand, and a^2 / T^2 of each, from the angle itself."""
    rng, seen, trembles = np.random.default_rng(seed), [], []
    line = np.linalg.qr(np.column_stack([np.ones_like(T), T]))[0]
    for _ in range(40):
        if kind == "trembles":
            phase = rng.uniform(0, 6.3, (12, 1, 3))
            hz = rng.uniform(1.0, 8.0, (12, 1, 1))
            angle = 1e-3 * np.cos(6.28 * hz * T[:, None] + phase).sum(axis=0)
        else:
            angle = 2e-4 * rng.normal(size=(len(T), 3)).cumsum(axis=0)
        about = angle - line @ (line.T @ angle)
        trembles.append((about**2).mean() / SECONDS**2)
        seen.append(force_turn_rate(force(angle, 0.003, rng), SECONDS))
    return seen, np.array(trembles)


def test_one_that_trembles_is_told_from_one_that_walks() -> None:
    """A random walk has 15 in the mean of a^2 and of the mean rate's square."""
    quiet = [drift_factor(*hands("trembles", seed)) for seed in range(12)]
    walks = [drift_factor(*hands("walks", seed)) for seed in range(12)]
    assert np.mean(quiet) < 3.0
    assert 9.0 < np.mean(walks) < 21.0
    assert min(walks) > max(quiet)


def test_if_nothing_tells_it_is_taken_to_walk() -> None:
    blind = [ForceTurn(0.0, np.inf)] * 3
    assert drift_factor(blind, np.full(3, 1e-8)) == pytest.approx(priors.WALKING_HAND_K)
    assert drift_factor(blind, np.zeros(3)) == priors.WALKING_HAND_K
    assert (
        drift_factor([ForceTurn(1e-9, 1e-9)] * 500, np.full(500, 1e-6))
        == priors.STEADY_HAND_K
    )
