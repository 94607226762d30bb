"""Which instabilities are looked at, and with which chance."""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import SD, dictionary, ladder, nominal, rows_of

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.evidence.sizing import (
    INSTABILITY_LOG_DENSITY,
    instability_log_prior,
)
from fieldcal.model.posterior.mixture import GIVEN_SET_LOG_DENSITY, Mixing
from fieldcal.model.priors import SIZES
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.window_rows import WindowSystem

X = ladder()
D = dictionary(X)
ROWS = 3
"""Of each window."""


def mixing(off: Array, given: bool = True) -> Mixing:
    """Hypotheses about rows that are off by something."""
    linear = WindowSystem(rows_of(X, np.hstack([X.f, X.w]) + off), D).linearised(
        nominal()
    )
    sets = Sets(D, gram(linear, D, np.zeros(D.width)))
    return Mixing(D, sets.gram, sets.evaluate(()), sets.typical_instability, given)


def wandering(seed: int) -> Array:
    rng = np.random.default_rng(seed)
    each = 3.0 * D.typical_instability[:6] * rng.standard_normal((9, 6))
    off: Array = SD * rng.standard_normal((len(X), 6)) + each[X.position]
    return off


@pytest.mark.parametrize("triad", [(0, 1, 2), (3, 4, 5)])
def test_what_cannot_be_seen_beside_the_noise_is_one_instability(
    triad: tuple[int, int, int],
) -> None:
    one = mixing(wandering(1))
    noise = SD[triad[0]] / np.sqrt(ROWS)
    typical = D.typical_instability[triad[0]]
    least = int(np.argmax(SIZES * typical >= 0.2 * noise))
    assert one._smallest_visible_index(triad) == least
    sizes, chance = one._shifted(triad)
    mode = one.fitted.sizes.instability
    assert all(s[c] == mode[c] for s in sizes for c in range(7) if c not in triad)
    middle = round(float(np.mean([mode[c] for c in triad])))
    steps = range(-middle, len(SIZES) - middle)
    every = []
    for s in steps:
        moved = [np.clip(m + s, 0, 32) if c in triad else m for c, m in enumerate(mode)]
        prior = instability_log_prior(
            np.array(moved), one.typical_instability, one.density
        )
        every.append(
            prior - instability_log_prior(mode, one.typical_instability, one.density)
        )
    assert len(sizes) == len(every) - max(0, least - 1)
    np.testing.assert_allclose(chance[1:], every[len(every) - len(sizes) + 1 :])
    total = np.logaddexp.reduce(np.array(every))
    assert np.logaddexp.reduce(chance) == pytest.approx(total)


def test_nobody_who_looked_for_causes_doubts_windows() -> None:
    asked, found = mixing(wandering(2)), mixing(wandering(2), False)
    np.testing.assert_allclose(
        np.exp(GIVEN_SET_LOG_DENSITY), priors.instability_density_of_given_set()
    )
    np.testing.assert_allclose(np.exp(INSTABILITY_LOG_DENSITY), priors.density(8.0))
    assert not found.run().bad.any() and asked.run().bad.any()
    assert len(asked.doubted) == 9
    for i, at in enumerate(asked.doubted):
        expected = [D.window_columns(c)[i] for c in range(3)]
        assert at.tolist() == expected
    hypotheses = asked._triad_hypotheses((3, 4, 5))
    assert {h.window for h in hypotheses} == {-1}
    best = max(h.score for h in hypotheses)
    assert min(h.score for h in hypotheses) > best - 4.0


def test_a_window_that_is_off_has_no_weight_and_its_mean_is_that_without_it() -> None:
    rng = np.random.default_rng(4)
    off = SD * rng.standard_normal((len(X), 6))
    off[:, 0] += 0.1 + 0.01 * X.f[:, 0]
    off[X.position == 5, :3] += [0.05, -0.03, 0.04]
    found = mixing(off).run()
    assert found.bad[5] > 0.99 and np.delete(found.bad, 5).max() < 0.1
    kept = X.position != 5
    design = np.column_stack([np.ones(kept.sum()), X.f[kept, 0]])
    plain = np.linalg.lstsq(design, off[kept, 0], rcond=None)[0]
    at = int(np.flatnonzero(found.columns == D.bias)[0])
    sigma = np.sqrt(found.covariance[at, at])
    assert abs(found.mean[at] - plain[0]) < 0.5 * sigma
