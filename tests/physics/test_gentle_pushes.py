"""Gentle pushes: how often by chance, in what kinds of noise, and how small."""

from __future__ import annotations

from math import exp

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.physics.gentle_pushes import GentlePush, gentle_pushes
from fieldcal.physics.matched_filter import MatchedFilter

HZ = 100.0


def trembling(rng: np.random.Generator, n: int, axes: Array) -> Array:
    """A motion along one direction that remembers 0.3 s."""
    course, x, keep = np.zeros(n), 0.0, exp(-1 / 30)
    for i, one in enumerate(rng.standard_normal(n).tolist()):
        x = keep * x + (1 - keep**2) ** 0.5 * one
        course[i] = x
    return np.outer(course, axes)


def windows(seed: int, kind: str) -> list[Array]:
    rng = np.random.default_rng(seed)
    out: list[Array] = []
    for _ in range(8):
        z = rng.standard_normal((1500, 6))
        if kind == "one axis":
            z += trembling(rng, len(z), 2 * rng.standard_normal(6))
        if kind == "levels":
            z += trembling(rng, len(z), np.exp(rng.normal()) * np.ones(6))
        out.append(z)
    return out


def pushed(z: Array, first: int, width: int, sigmas: float) -> Array:
    """Outputs with a push along a slanted axis of the gyroscopes."""
    wave = np.sin(np.pi * (np.arange(width) + 0.5) / width)
    height = sigmas * MatchedFilter.for_length(width).sigma
    out = z.copy()
    out[first : first + width, 3:] += height * np.outer(wave, [0.6, -0.48, 0.64])
    return out


@pytest.mark.parametrize("kind", ["white", "one axis", "levels"])
def test_noise_is_hardly_ever_pushed(kind: str) -> None:
    """Once in a thousand recordings is meant."""
    seeds = 40 if kind == "white" else 15
    found = sum(any(gentle_pushes(windows(s, kind), HZ)) for s in range(seeds))
    assert found <= 1


@pytest.mark.parametrize(("width", "at"), [(50, 300), (100, 700), (200, 900)])
def test_a_push_of_twelve_sigma_is_found_where_it_was(width: int, at: int) -> None:
    """No sample of it stands out, and no axis by itself is further off than 7.7."""
    found = 0
    for seed in range(10):
        z = windows(seed, "white")
        z[3] = pushed(z[3], at, width, 12.0)
        each = gentle_pushes(z, HZ)
        assert not any(each[:3] + each[4:])
        for push in each[3]:
            found += 1
            assert abs((push.first + push.last) / 2 - at - width / 2) < width / 3
            assert 0.4 * width < push.last - push.first < 2.5 * width
            assert push.channel >= 3
    assert 9 <= found <= 10


def test_the_height_of_a_push_is_its_own() -> None:
    sizes = []
    for seed in range(10):
        z = windows(seed, "white")
        z[2] = pushed(z[2], 600, 100, 12.0)
        (push,) = gentle_pushes(z, HZ)[2]
        sizes.append(push.deviation)
        assert push.log_chance < push.limit < -5
        assert push.amplitude == pytest.approx(
            12.0 * 0.64 * MatchedFilter.for_length(100).sigma, rel=0.4
        )
    # in so many degrees of freedom, 12 of their sigmas are as rare as these of a normal
    assert 6.0 < np.mean(sizes) < 12.0


def test_a_hand_that_always_moves_like_that_is_not_pushed_and_a_calm_one_is() -> None:
    z = windows(1, "levels")
    level = [float(one[:, 3].std()) for one in z]
    loud, calm = int(np.argmax(level)), int(np.argmin(level))
    for window, seen in ((loud, False), (calm, True)):
        some = z.copy()
        some[window] = pushed(z[window], 700, 100, 35.0)
        assert bool(gentle_pushes(some, HZ)[window]) == seen


def test_two_pushes_in_one_window_are_both_found() -> None:
    z = windows(5, "white")
    z[0] = pushed(pushed(z[0], 200, 100, 14.0), 1000, 100, 25.0)
    strong, weak = gentle_pushes(z, HZ)[0]
    assert strong.first > 900 and weak.first < 320


def test_a_push_is_no_longer_there_once_it_is_taken_away() -> None:
    z = windows(6, "white")
    with_push = pushed(z[0], 700, 100, 15.0)
    push: GentlePush = gentle_pushes([with_push, *z[1:]], HZ)[0][0]
    assert push.is_in(with_push) and not push.is_in(z[0])
    assert not push.is_in(z[0][:50])


def test_a_recording_of_nothing_has_no_push() -> None:
    assert gentle_pushes([], HZ) == []
    assert gentle_pushes([np.zeros((30, 6))], 1.0) == [[]]
    assert gentle_pushes([np.full((3000, 6), np.nan)], HZ) == [[]]
