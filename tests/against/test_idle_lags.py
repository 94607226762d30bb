"""Lags of a recording in motion: which are removed, by a table of evidences."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, cast

import pytest

from fieldcal.against.motion import following
from fieldcal.effects import catalogue
from fieldcal.model.evidence.sizing import Member

NAMES = ("bandwidth", "time_delay", "lever_arm")


def member(name: str) -> Member:
    effect = catalogue()[name]
    return cast(
        Member, (SimpleNamespace(key=name), SimpleNamespace(effect=effect, name=name))
    )


class Fit:
    """A fit whose evidences are known: about what was settled, and of what is there.

    `about` are those of sets about the rows that were settled with all members, `own`
    those of sets that have a fit of their own.
    """

    def __init__(self, about: Mapping[str, float], own: Mapping[str, float]) -> None:
        self.about, self.own = about, own
        self.settled: list[str] = []
        self.new = False

    def copy(self) -> Fit:
        out = Fit(self.about, self.own)
        out.new, out.settled = True, self.settled
        return out

    def settle(self, members: tuple[Any, ...]) -> None:
        self.settled.append(" ".join(c.key for c, _ in members))

    def evidence(self, members: tuple[Any, ...]) -> float:
        named = " ".join(c.key for c, _ in members)
        return (self.own if self.new else self.about)[named]


ALL = "bandwidth time_delay lever_arm"


@pytest.mark.parametrize(
    ("about", "own", "left", "tried"),
    [
        # a delay that is none looks worse, as the filter would have to move with it
        (
            {ALL: 0.0, "time_delay lever_arm": -49e3, "bandwidth lever_arm": -190.0},
            {"bandwidth lever_arm": 9.8},
            "bandwidth lever_arm",
            ["bandwidth lever_arm"],
        ),
        # a cubic one that is none looks worse by its square, nine times the margin
        (
            {ALL: 0.0, "time_delay lever_arm": -53.9, "bandwidth lever_arm": -53.0},
            {"time_delay lever_arm": 0.1, "lever_arm": -8.0},
            "time_delay lever_arm",
            ["time_delay lever_arm", "lever_arm"],
        ),
        # both are there
        (
            {ALL: 0.0, "time_delay lever_arm": -54.1, "bandwidth lever_arm": -53.0},
            {"bandwidth lever_arm": -7.0},
            ALL,
            ["bandwidth lever_arm"],
        ),
    ],
)
def test_lags_are_fitted_away_but_the_one_that_is_surely_there(
    about: Mapping[str, float], own: Mapping[str, float], left: str, tried: list[str]
) -> None:
    fit = Fit(about, own)
    members = tuple(member(name) for name in NAMES)
    found, kept = following._without_idle_lags(cast(Any, fit), members)
    assert " ".join(c.key for c, _ in kept) == left
    assert fit.settled == tried
    assert (cast(Any, found) is fit) == (left == ALL)


def test_without_lags_nothing_is_tried() -> None:
    members = (member("lever_arm"),)
    fit = cast(Any, Fit({}, {}))
    assert following._without_idle_lags(fit, members) == (fit, members)
