"""That the benchmark of the search tells when a set is overlooked."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.concealed.sessions import SETS
from benchmarks.optimum import NEARLY, best_of_these, compared, drawn
from fieldcal.diagnosis.explain import explain
from fieldcal.diagnosis.prepare import prepare_recording

SEED = 77_000_000


@pytest.mark.thorough
def test_most_positions_are_laid_by_hand_at_whole_five_degrees() -> None:
    by_hand = 0
    for seed in range(SEED, SEED + 12):
        session = drawn(np.random.default_rng(seed), 2)
        assert len(session.concealed) == 2
        angles = [
            tuple(np.rad2deg([w.alpha, w.beta]).round(6)) for w in session.windows
        ]
        if {*angles} <= {*SETS[session.place]}:
            continue
        by_hand += 1
        np.testing.assert_allclose(np.remainder(np.array(angles) + 1, 5), 1)
    assert 4 <= by_hand < 12


@pytest.mark.thorough
def test_a_set_without_what_is_there_is_overlooking_it() -> None:
    session = drawn(np.random.default_rng(SEED), 2)
    one = compared(session, SEED)
    assert one.right and one.overlooked <= NEARLY and one.there is not None
    found = explain(prepare_recording(session.record(SEED), session.about)).inferred
    nothing = one._replace(found=found.search.sets.evaluate(()))
    assert nothing.overlooked > 10.0 and not nothing.right
    assert best_of_these(found, ("no such effect",)) is None
