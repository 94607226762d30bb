"""Sets in which all biases jump in a gap."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.model import priors
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.search.restarts import sets_with_restarts, visit_restart

X = ladder()
JUMPS = ("bias_step:acc", "bias_step:gyr")


def sets_of(gaps: tuple[float, ...], jump: float) -> tuple[Sets, tuple[float, ...]]:
    """Sets over noise, and biases that jump at the last gap by so many usual sizes."""
    session = Session.of(X, (*JUMPS, "quadratic"))
    d = session.dictionary
    d.shown = np.ones(d.width, dtype=bool)
    instants = np.array(sorted({g.shape["at_s"] for g in d.causes[0].variants}))
    gaps = tuple(float(instants[np.argmin(np.abs(instants - gap))]) for gap in gaps)
    d.expect_within([(gap - 1e-3, gap + 1e-3) for gap in gaps])
    off = session.noise(np.random.default_rng(3))
    if gaps:
        off[X.t > gaps[-1]] += jump * np.repeat([5e-2, 2e-3], 3)
    return session.search(off).sets, gaps


def jumps_of(sets: Sets) -> list[tuple[float, ...]]:
    """Sizes of the jumps of each visited set with both."""
    return [
        tuple(float(g.typical[0]) for c, g in one.members if c.key in JUMPS)
        for one in sets.visited.values()
        if set(JUMPS) <= one.keys
    ]


def test_without_a_gap_there_is_none() -> None:
    sets, _ = sets_of((), 1.0)
    before = len(sets.visited)
    visit_restart(sets, sets.evaluate(()))
    assert sets_with_restarts(sets, sets.evaluate(())) == []
    assert len(sets.visited) == max(before, 1)


def test_each_gap_has_its_likeliest_jumps_beside_other_causes() -> None:
    sets, gaps = sets_of((100.0, 160.0), 1.0)
    (quadratic,) = [c for c in sets.dictionary.causes if c.name == "quadratic"]
    beside = sets.evaluate(((quadratic, quadratic.variants[0]),))
    found = sets_with_restarts(sets, beside)
    assert len(found) == 2
    for one, gap in zip(found, gaps, strict=True):
        assert set(one.keys) == {*JUMPS, "quadratic"}
        at = {g.shape["at_s"] for c, g in one.members if c.key in JUMPS}
        assert at == {gap}
    assert found[1].score > found[0].score


@pytest.mark.parametrize("jump", [0.0, 1.0])
def test_jumps_of_every_size_are_visited_in_the_likeliest_gap(jump: float) -> None:
    sets, gaps = sets_of((100.0, 160.0), jump)
    visit_restart(sets, sets.evaluate(()))
    acc, gyr = (
        sorted({float(g.typical[0]) for g in c.variants if g in c.expected})
        for c in (
            next(c for c in sets.dictionary.causes if c.key == key) for key in JUMPS
        )
    )
    assert len(acc) == len(gyr) == len(priors.RESTART_SIZES)
    assert {*product(acc, gyr)} <= {*jumps_of(sets)}


def test_what_jumps_already_stays_as_it_is() -> None:
    sets, gaps = sets_of((160.0,), 1.0)
    cause = next(c for c in sets.dictionary.causes if c.key == JUMPS[0])
    group = next(g for g in cause.variants if g in cause.expected)
    begun = sets.evaluate(((cause, group),))
    visit_restart(sets, begun)
    both = [one for one in sets.visited.values() if set(JUMPS) <= one.keys]
    assert len(both) == len(priors.RESTART_SIZES)
    assert all((cause, group) in one.members for one in both)
