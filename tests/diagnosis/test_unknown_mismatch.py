"""Errors of angles that were set wrongly, each with the positions that have it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings import unknown_mismatch
from fieldcal.diagnosis.findings.unknown_mismatch import unknown_mismatches
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
