"""Sets with other parameters or fewer causes, against every set that there is."""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.model.search.variations import (
    drop_superfluous,
    widen_outputs,
    with_all_parameters,
)

KEYS = ("angle_offset", "quadratic", "g_sensitivity", "bias_drift:acc")
SESSION = Session.of(ladder(), KEYS)
CAUSES = {c.key: c for c in SESSION.dictionary.causes}


@pytest.mark.parametrize("there", [(), ("quadratic",), ("quadratic", "bias_drift:acc")])
def test_what_a_set_has_too_much_is_dropped(there: tuple[str, ...]) -> None:
    """One after another, as long as the weight rises; of nothing there is nothing."""
    rng = np.random.default_rng(3)
    off = SESSION.noise(rng)
    for key in there:
        group = CAUSES[key].full_variant(CAUSES[key].variants[0])
        off += SESSION.design[:, :, group.columns] @ (0.3 * group.typical)
    sets = SESSION.search(off).sets
    members = tuple((CAUSES[k], CAUSES[k].full_variant(CAUSES[k].variants[0]))
                    for k in KEYS)  # fmt: skip
    found = drop_superfluous(sets, members)
    assert found.keys == {*there}
    for i in range(len(found.members)):
        assert sets.without(found, i).score <= found.score
    nothing = drop_superfluous(sets, ())
    assert nothing.members == () and nothing.score == sets.evaluate(()).score


def test_a_cause_has_more_outputs_where_that_is_likelier() -> None:
    """And all of them where all are asked for."""
    cause = CAUSES["bias_drift:acc"]
    whole = cause.full_variant(cause.variants[0])
    one = next(g for g in cause.variants if len(g.params) == 1 and 1 in g.params)
    for size, wider in ((np.array([0.0, 0.5, 0.0]), False), (np.full(3, 0.5), True)):
        off = SESSION.noise(np.random.default_rng(4))
        off += SESSION.design[:, :, whole.columns] @ (size * whole.typical)
        sets = SESSION.search(off).sets
        current = sets.evaluate(((cause, one),))
        ((_, group),) = widen_outputs(sets, current).members
        assert {*group.params} == ({*whole.params} if wider else {1})
        ((_, every),) = with_all_parameters(sets, current).members
        assert every is whole
