"""Noise that every device has counts in a posterior, and is told by no name."""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.model.posterior.probabilities import Posterior

KEYS = ("flicker:acc", "random_walk:acc", "bias_drift:acc")
SESSION = Session.of(ladder(rows=12), KEYS, 0.5)


def drawn(key: str, size: float, seed: int) -> Posterior:
    """Of a session with one of the causes at some size."""
    rng = np.random.default_rng(seed)
    (cause,) = (c for c in SESSION.dictionary.causes if c.key == key)
    group = cause.variants[0]
    value = group.prior_sigma(size) * rng.standard_normal(len(group.columns))
    off = SESSION.noise(rng, np.zeros(7)) + SESSION.design[:, :, group.columns] @ value
    search = SESSION.search(off)
    return Posterior(search, search.run())


@pytest.mark.parametrize("seed", range(4))
def test_flicker_is_nothing_that_is_left_out(seed: int) -> None:
    found = drawn("flicker:acc", 3.0, seed)
    assert "flicker:acc" in found.best.keys
    assert found.probable_causes() == [] and found.probability_of_noise_alone > 0.5
    assert "flicker" not in dict(found.ranked_causes())


@pytest.mark.parametrize("seed", range(4))
def test_a_set_with_flicker_instead_takes_from_what_is_named(seed: int) -> None:
    """It is weighed, though it is no alias."""
    found = drawn("random_walk:acc", 2.0, seed)
    instead = [s for s, _ in found.weights if s.keys == {"flicker:acc"}]
    assert len(instead) == 1
    for standing in found.probable_causes():
        assert "flicker" not in standing.aliases
    named = found.probability(["random_walk"]) + found.probability(["bias_drift"])
    assert found.probability_of_noise_alone + named >= 1 - 1e-9
