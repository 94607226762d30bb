"""Causes of a recording in motion beside explanations that are nearly as likely."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fieldcal.against.motion.explanation import MotionExplanation, Rival
from fieldcal.model.posterior.probabilities import ProbableCause


def explanation(*rivals: tuple[set[str], float]) -> MotionExplanation:
    """One of a filter and a delay; rivals by their causes and how far behind."""
    names = ("bandwidth", "time_delay")
    causes = [(SimpleNamespace(name=n, reportable=True), None) for n in names]
    posterior: Any = SimpleNamespace(
        probable_causes=lambda: [ProbableCause(n, (), 0.9, ()) for n in names]
    )
    inferred: Any = SimpleNamespace(best=SimpleNamespace(members=causes))
    fit: Any = None
    others = [Rival(frozenset(n), 100.0 - behind) for n, behind in rivals]
    return MotionExplanation(fit, inferred, posterior, 100.0).beside(others)


def test_without_rivals_causes_are_as_likely_as_the_search_says() -> None:
    found = explanation().probable_causes()
    assert [(c.name, c.probability, c.aliases) for c in found] == [
        ("bandwidth", 0.9, ()), ("time_delay", 0.9, ())
    ]  # fmt: skip


def test_a_rival_that_no_one_would_question_is_an_alias() -> None:
    first, second = explanation(
        ({"flexible_mount", "time_delay"}, 2.0)
    ).probable_causes()
    assert first.aliases == ("flexible_mount",) and first.probability == 0.9
    assert second.aliases == (), "the rival has it too"


def test_a_rival_farther_behind_takes_its_share_of_the_probability() -> None:
    first, second = explanation(
        ({"flexible_mount", "time_delay"}, 5.0)
    ).probable_causes()
    odds = np.exp(-5.0)  # of the rival against the best
    assert first.probability == pytest.approx(0.9 / (1 + odds)) and not first.aliases
    assert second.probability == 0.9


def test_what_has_nothing_else_or_is_far_behind_is_no_rival() -> None:
    found = explanation(
        ({"bandwidth"}, 1.0), ({"time_delay"}, 2.0), ({"flexible_mount"}, 9.0)
    )
    assert found.rivals == ()


def test_of_the_same_causes_the_likelier_is_the_rival() -> None:
    found = explanation(({"cubic"}, 1.0), ({"cubic"}, 3.0))
    assert found.rivals == (Rival(frozenset({"cubic"}), 99.0),)


def test_a_rival_far_ahead_leaves_nothing_to_another() -> None:
    """As of two recordings that have the very same noise."""
    with np.errstate(over="raise", invalid="raise"):
        first, _ = explanation(
            ({"flexible_mount", "time_delay"}, -900.0), ({"cubic", "time_delay"}, 5.0)
        ).probable_causes()
    assert first.aliases == ("flexible_mount",) and first.probability == 0.9
