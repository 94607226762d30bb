"""Errors of angles that were set wrongly, each with the positions that have it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings import unknown_mismatch
from fieldcal.diagnosis.findings.unknown_mismatch import (
    exchanged_positions,
    unknown_mismatches,
)
from fieldcal.diagnosis.result import Mismatch
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.posterior.probabilities import ProbableCause


def off_in(positions: tuple[int, ...]) -> Mismatch:
    return Mismatch("ax", "position", positions, 0.0, 30.0, "the position", 0.1, 9.0)


def test_two_wrong_angles_each_have_their_own_positions_and_size(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def estimates(_: Any, columns: Any) -> tuple[Any, Any, Any]:
        values = np.deg2rad([0.2, -0.3, 0.001])[columns]
        return values, np.full(len(columns), np.deg2rad(0.01)), np.eye(len(columns))

    monkeypatch.setattr(unknown_mismatch, "column_estimates", estimates)
    wide = np.ones(1)
    shared = Group(
        "wrong", "", np.array([0]), wide, params=(0,), moved_positions=(1, 4)
    )
    single = Group("wrong", "", np.array([1, 2]), wide, params=(1, 0), position=6)
    cause = Cause("wrong", "", 0.01, (shared, single), "position")
    standing = ProbableCause("wrong", ((cause, shared), (cause, single)), 1.0, ())
    explanation = cast(Explanation, SimpleNamespace(best=SimpleNamespace(set=None)))
    first, second = unknown_mismatches(
        explanation, standing, [off_in((1, 4)), off_in((6,))]
    )
    assert [j for j, _ in first.angle_errors] == ["α"]
    assert [j for j, _ in second.angle_errors] == ["β"], (
        "0.001 ± 0.01° does not stand out"
    )
    assert first.angle_errors[0][1].value == pytest.approx(0.2)
    assert second.angle_errors[0][1].value == pytest.approx(-0.3)


@pytest.mark.parametrize(
    ("part", "exchanged"), [(1.0, [(2, 5)]), (0.97, [(2, 5)]), (0.93, [])]
)
def test_positions_are_exchanged_if_each_was_held_where_the_other_is(
    part: float, exchanged: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """40 and -20 deg apart; 7 % of that is another angle, and not the other's."""
    stated = np.deg2rad([[10.0, 5.0], [50.0, -15.0]])
    off = part * (stated[1] - stated[0])

    def estimates(_: Any, columns: Any) -> tuple[Any, Any, Any]:
        return np.concatenate([off, -off])[columns], np.ones(2), np.eye(2)

    monkeypatch.setattr(unknown_mismatch, "column_estimates", estimates)
    groups = [
        Group("misset", "", np.array(at), np.ones(2), params=(0, 1), position=p)
        for p, at in ((2, [0, 1]), (5, [2, 3]))
    ]
    members = tuple(
        (Cause("misset", "", 0.01, (g,), "position", position=g.position), g)
        for g in groups
    )
    x = SimpleNamespace(
        position=np.array([2, 5]), alpha=stated[:, 0], beta=stated[:, 1]
    )
    explanation = cast(
        Explanation,
        SimpleNamespace(best=SimpleNamespace(set=None), rows=SimpleNamespace(x=x)),
    )
    standing = ProbableCause("misset", members, 1.0, ())
    assert exchanged_positions(explanation, standing) == exchanged
    off_there = [off_in((2,)), off_in((5,))]
    told = unknown_mismatches(explanation, standing, off_there)
    for one in told:
        assert one.exchanged == (exchanged[0] if exchanged else ())
        assert not (exchanged and one.angle_errors), "nothing is off besides"
