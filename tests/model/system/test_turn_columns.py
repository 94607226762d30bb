"""Columns that turns meet: those of all turns at once are those of each by itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from benchmarks.concealed import kinds
from fieldcal.core.samples import Array, Mask
from fieldcal.diagnosis.fit import build_fit
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.model.causes.basis import Course, RowView
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.state import State
from fieldcal.model.system.turn_columns import ColumnsOfTurns, TurnColumns
from fieldcal.model.system.turn_force_rows import turn_force_columns
from fieldcal.model.turns.turn import Turn
from fieldcal.model.turns.turn_tracker import TurnTracker
from fieldcal.physics.experience import Experience


def turned_fit(kind: str) -> tuple[GaussNewton, TurnTracker]:
    """The fit of a session with turns, and what integrates them."""
    session = kinds()[kind][0](np.random.default_rng(3))
    fit = build_fit(prepare_recording(session.record(3), session.about))
    assert fit.turns is not None
    return fit, fit.turns.tracker


def test_all_turns_at_once_are_each_by_itself() -> None:
    """With every column that a session has, on the way as well."""
    fit, tracker = turned_fit("gyro_scale")
    d = fit.dictionary
    (scale,) = [c for c in d.causes if c.key == "gyro_scale"]
    for members in ((), ((scale, scale.variants[0]),)):
        state, values, best = fit.settle(fit.nominal, np.zeros(d.width), members)
        fit.gram(state, values, best)
        turns = list(tracker.turns(state))
        since = [tracker.time_since_turn(turn.t, turn.positions[1]) for turn in turns]
        views = [
            RowView(turn.x, turn.x, time, state)
            for turn, time in zip(turns, since, strict=True)
        ]
        known = d.bases, tracker.rows.x, False
        every = ColumnsOfTurns(state, turns, views, True).of_bases(*known)
        assert len(every) > 5 and all(met.general for met in every)
        for turn, view, met in zip(turns, views, every, strict=True):
            (alone,) = ColumnsOfTurns(state, [turn], [view], True).of_bases(*known)
            assert_same_columns(met, alone, turn_force_columns(d, best))
    assert [t.effect.id for t in state.terms] == ["gyro_scale"]


def test_rows_about_the_same_state_are_linearised_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Once more only for what was added; they are those of a fit that asks first."""
    fit, tracker = turned_fit("bias_drift")
    state, values, best = fit.settle(fit.nominal, np.zeros(fit.dictionary.width), ())
    other = fit.continuing_copy()
    calls: list[State] = []
    turned = TurnTracker.turns

    def counted(tracker: TurnTracker, state: State) -> Iterator[Turn]:
        calls.append(state)
        yield from turned(tracker, state)

    monkeypatch.setattr(TurnTracker, "turns", counted)
    fit.gram(state, values, None)
    linear = fit.system.linearised(state)
    for each in (fit.dictionary, other.dictionary):
        each.add_course("new", lambda x: np.sin(x.t)[:, None], 1, True)
        each.add_causes([])
    again = fit.gram(state, values, best)
    assert calls == [state]
    new = fit.system.linearised(state)
    for before, after in zip(linear, new, strict=True):
        assert before.design.shape[1] + 1 == after.design.shape[1]
    first = other.gram(state, values, best)
    every = np.arange(fit.dictionary.width)
    assert_near(again.within.part(every, every), first.within.part(every, every))
    for name in ("rhs", "means", "residual", "info", "closure_errors"):
        assert_near(getattr(again, name), getattr(first, name))


def assert_near(found: Array, same: Array) -> None:
    np.testing.assert_allclose(found, same, rtol=1e-9, atol=1e-9 * np.abs(same).max())


def assert_same_columns(one: TurnColumns, other: TurnColumns, used: Mask) -> None:
    np.testing.assert_array_equal(one.index, other.index)
    np.testing.assert_allclose(one.closing, other.closing, rtol=1e-12, atol=1e-300)
    for (columns, outputs), (own, alone) in zip(
        one.during_turn(used), other.during_turn(used), strict=True
    ):
        np.testing.assert_array_equal(columns, own)
        np.testing.assert_allclose(outputs, alone, rtol=1e-12, atol=1e-300)


def test_a_basis_added_later_has_the_columns_that_it_has_from_the_start() -> None:
    """And those of a basis that is there already are not calculated again."""
    calls: list[str] = []

    def level(name: str) -> Course:
        def evaluate(view: RowView) -> Array:
            calls.append(name)
            return np.full((len(view.x), 1), len(name))

        return Course(name, evaluate, 1, timed=True)

    bases = [(0, level("one")), (6, level("three"))]
    turn, view = turn_about_z()
    later = ColumnsOfTurns(view.state, [turn], [view], False)
    later.of_bases(bases[:1], turn.ends, False)
    (found,) = later.of_bases(bases, turn.ends, False)
    assert calls == ["one", "three"]
    (at_once,) = ColumnsOfTurns(view.state, [turn], [view], False).of_bases(
        bases, turn.ends, False
    )
    np.testing.assert_array_equal(found.index, at_once.index)
    np.testing.assert_array_equal(found.closing, at_once.closing)


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
    along, views = zip(*turns, strict=True)
    met = ColumnsOfTurns(views[0].state, along, views, False)
    return met.of_bases([(0, LEVEL), (10, course)], along[0].ends, unoriented)


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
