"""A cause that two sessions show with time constants of their own."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.against import pairing
from fieldcal.effects import catalogue
from fieldcal.model.causes.cause import Group


def group(name: str, shape: dict[str, float], sigma: float) -> Group:
    at, effect = np.arange(1), catalogue()[name]
    (value,) = shape.values()
    known = None if np.isnan(sigma) else np.full((1, 1), (sigma / value) ** 2)
    return Group(name, "gyr", at, np.ones(1), effect, shape, shape_covariance=known)


def test_a_time_constant_of_both_is_by_what_each_tells_of_it() -> None:
    """Drawn: of a thousand pairs it scatters as the best mean of both does."""
    rng, true, parts = np.random.default_rng(1), 97.0, (0.1, 0.25)
    found = []
    for _ in range(1000):
        one, two = (
            group("warm_up", {"tau_s": tau}, part * tau)
            for part in parts
            for tau in [true * float(np.exp(part * rng.standard_normal()))]
        )
        both = pairing._shape_of_both(one, two)
        assert both is not None
        found.append(np.log(both.shape["tau_s"] / true))
    best = 1 / np.sqrt(sum(1 / part**2 for part in parts))
    assert np.mean(found) == pytest.approx(0.0, abs=4 * best / np.sqrt(1000))
    assert np.std(found) == pytest.approx(best, rel=0.1)


def test_what_one_does_not_tell_and_an_instant_are_not_averaged() -> None:
    known = group("warm_up", {"tau_s": 90.0}, 9.0)
    unsure = group("warm_up", {"tau_s": 60.0}, np.nan)
    assert pairing._shape_of_both(known, unsure) is None
    event = group("bias_step", {"at_s": 30.0}, 0.1)
    assert pairing._shape_of_both(event, event) is None
