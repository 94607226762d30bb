"""Columns that turns meet: those of all turns at once are those of each by itself."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from benchmarks.concealed import kinds
from fieldcal.core.samples import Array
from fieldcal.diagnosis.fit import build_fit
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.model.causes.basis import Course, RowView
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.state import State
from fieldcal.model.system import turn_rows
from fieldcal.model.system.turn_columns import TurnColumns, columns_of_turns
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.experience import Experience


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
    fit = build_fit(prepared)
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


RATE, SECONDS = 0.3, 4.0
SCALE = np.array([1.02, 0.98, 1.05])


def turn_about_z(standing: Array | None = None) -> tuple[Turn, RowView]:
    """A turn at an even rate, and its edges."""
    t = np.linspace(0.0, SECONDS, 2001)
    sine, cosine, none = np.sin(RATE * t), np.cos(RATE * t), np.zeros(len(t))
    attitude = np.array(
        [[cosine, sine, none], [-sine, cosine, none], [none, none, none + 1.0]]
    ).transpose(2, 0, 1)  # from axes at the start to axes at the edge
    x = Experience.at_rest(none, none, 9.81, t=t)
    turn = Turn((0, 1), x, x, x.f, attitude, t / SECONDS, np.zeros(0, int), none, none,
                0.0, 0.01, standing)  # fmt: skip
    state = State(np.zeros(6), np.r_[1.0, 1.0, 1.0, SCALE], np.zeros((2, 2)), none[:3])
    return turn, RowView(x, x, t[None], state)


LEVEL = Course("level", lambda view: np.ones((len(view.x), 1)), 1, timed=True)


def seen(course: Course, unoriented: bool, *turns: tuple[Turn, RowView]) -> list[Any]:
    """Columns in some turns: of a level the first, of a course from 10 on."""
    bases = [(0, LEVEL), (10, course)]
    some = SimpleNamespace(bases=bases, unoriented=np.array([unoriented]))
    along, views = zip(*turns, strict=True)
    return columns_of_turns(along, views, cast(Dictionary, some), {}, None)


def closing_of(found: TurnColumns, index: int) -> Array:
    """Derivative of the closure by one column, which is there once."""
    (at,) = np.flatnonzero(found.index == index)
    return found.closing[:, at]


@pytest.mark.parametrize("unoriented", [False, True])
def test_a_course_turns_the_closure_by_its_integral_in_axes_at_the_start(
    unoriented: bool,
) -> None:
    """By gyroscopes alone; accelerometers do so where they tell the orientation."""
    course = Course(
        "line", lambda view: np.column_stack([np.ones(len(view.x)), view.x.t]), 2, True
    )
    for found in seen(course, unoriented, turn_about_z(), turn_about_z()):
        first = 10 if unoriented else 16
        own = np.sort(found.index[found.index >= 10])
        np.testing.assert_array_equal(own, np.arange(first, 22))
        for index in range(first, 16):
            assert not closing_of(found, index).any()
        w, s, c = RATE, np.sin(RATE * SECONDS), np.cos(RATE * SECONDS)
        along = np.array([s / w, (1 - c) / w])  # integral of (cos, sin)
        with_time = np.array(  # integral of t (cos, sin)
            [SECONDS * s / w + (c - 1) / w**2, s / w**2 - SECONDS * c / w]
        )
        for m, (cosine, sine) in enumerate((along, with_time)):
            size = SECONDS ** (m + 1) / (m + 1)
            expected = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, size]])
            for j in range(3):
                column = closing_of(found, 16 + 2 * j + m)
                np.testing.assert_allclose(column, expected[j] / SCALE[j], atol=1e-5)


@pytest.mark.parametrize("unoriented", [False, True])
def test_what_lasts_while_an_output_stands_turns_by_its_share_of_the_time(
    unoriented: bool,
) -> None:
    """A third, half and all of it; where no share is known, by nothing."""
    share = np.tile([1 / 3, 0.5, 1.0], (2001, 1))
    course = Course("rounding", lambda view: np.full((len(view.x), 1), np.nan), 1,
                    while_output_stands=True)  # fmt: skip
    (shown, never) = seen(course, unoriented, turn_about_z(share), turn_about_z())
    for j, part in enumerate(share[0]):
        expected = closing_of(shown, 3 + j) * part
        assert expected.any()
        np.testing.assert_allclose(closing_of(shown, 13 + j), expected, atol=1e-12)
    for found, last in ((shown, 16), (never, 13)):
        own = found.index >= 10
        first = 10 if unoriented else 13
        np.testing.assert_array_equal(found.index[own], np.arange(first, last))
        assert not found.closing[:, own & (found.index < 13)].any()
