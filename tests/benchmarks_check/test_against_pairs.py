"""Pairs of recordings that a benchmark draws, and how it judges what is said."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.against import LARGER, drawn, judged, pair
from benchmarks.concealed.draws import FIXED, single
from fieldcal.against import Match
from fieldcal.against.result import Difference, Direction, Facts, SimulatorPrediction
from fieldcal.effects import catalogue
from fieldcal.sim_device.effects import kind

FACTS = Facts(100.0, np.nan, np.nan, 0.0, np.nan, {})


def match(*differences: Difference) -> Match:
    predicted = SimulatorPrediction(0.1, 0.1, 1.0)
    return Match(
        "left_out", 1.0, differences, (), predicted, predicted, FACTS, FACTS, (), ""
    )  # fmt: skip


def said(name: str, direction: Direction, *aliases: str) -> Difference:
    return Difference(name, direction, 1.0, {}, aliases)


def test_pairs_differ_in_what_is_drawn_and_in_nothing_else() -> None:
    session = single("quadratic", np.random.default_rng(3), 15.0)
    for relation, sizes in (
        ("left_out", (1.0, 0.0)), ("added", (0.0, 1.0)),
        ("resized", (LARGER, 1.0)), ("equal", (1.0, 1.0)),
    ):  # fmt: skip
        both = pair(session, relation)
        assert both is not None
        for one, size in zip(both, sizes, strict=True):
            there = [e for e in one.profile.effects if e.id == "quadratic"]
            given = there[0].parameters if there else {}
            for name, value in session.concealed["quadratic"].items():
                factor = 1.0 if name in FIXED else size
                assert given.get(name, 0.0) == pytest.approx(factor * value)
            rest = {e.id for e in one.profile.effects} - {"quadratic"}
            assert rest == {e.id for e in session.profile.effects} - {"quadratic"}
            assert one.windows == session.windows


def test_everything_in_the_catalogue_is_drawn() -> None:
    moving = {name for name in catalogue() if kind(name).EXAMPLE.in_motion}
    expected = set(catalogue()) - {"earth_rate"} - moving | {"bandwidth"}
    assert {name for name, _ in drawn()} == expected


def test_what_is_said_is_judged_by_name_direction_and_what_is_too_much() -> None:
    right = judged("added", "quadratic", match(said("quadratic", "added")), 1.0)
    assert right.named and right.directed and not (right.aliased or right.false)
    tied = match(said("cubic", "left_out", "quadratic"), said("noise", "resized"))
    alias = judged("added", "quadratic", tied, 1.0)
    assert alias.aliased and alias.false and not (alias.named or alias.directed)
    knocked = match(said("base_step", "added"), said("bump", "added"))
    assert not judged("added", "base_step", knocked, 1.0).false
    assert judged("added", "quadratic", knocked, 1.0).false
    quiet = judged("equal", "quadratic", match(), 1.0)
    assert quiet.named and not quiet.false
    loud = judged("equal", "quadratic", match(said("quadratic", "added")), 1.0)
    assert loud.false and not loud.named
