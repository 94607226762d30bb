"""Columns that turns meet: those of all turns at once are those of each by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.concealed import kinds
from fieldcal.diagnosis.explain import build_fit
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.model.causes.basis import RowView
from fieldcal.model.system import turn_rows
from fieldcal.model.system.turn_columns import TurnColumns, columns_of_turns
from fieldcal.model.turns.turn import Turn


def test_all_turns_at_once_are_each_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """With every column that a session has, on the way as well."""
    seen: list[tuple[TurnColumns, TurnColumns]] = []

    def both(turns: list[Turn], views: list[RowView], *known: Any) -> list[TurnColumns]:
        out = columns_of_turns(turns, views, *known)
        for turn, view, met in zip(turns, views, out, strict=True):
            (alone,) = columns_of_turns([turn], [view], *known)
            seen.append((met, alone))
        return out

    monkeypatch.setattr(turn_rows, "columns_of_turns", both)
    session = kinds()["gyro_scale"][0](np.random.default_rng(3))
    prepared = prepare_recording(session.record(3), session.about)
    fit = build_fit(prepared.source, prepared.rows, prepared)
    (scale,) = [c for c in fit.dictionary.causes if c.key == "gyro_scale"]
    nothing = np.zeros(fit.dictionary.width)
    for members in ((), ((scale, scale.variants[0]),)):
        state, values, best = fit.settle(fit.nominal, nothing, members)
        fit.gram(state, values, best)
    assert [t.effect.id for t in state.terms] == ["gyro_scale"]
    assert len(seen) > 10 and any(met.general for met, _ in seen)
    for met, alone in seen:
        np.testing.assert_array_equal(met.index, alone.index)
        np.testing.assert_allclose(met.closing, alone.closing, rtol=1e-12, atol=1e-300)
        for (columns, outputs), (own, other) in zip(
            met.general, alone.general, strict=True
        ):
            np.testing.assert_array_equal(columns, own)
            np.testing.assert_allclose(outputs, other, rtol=1e-12, atol=1e-300)
