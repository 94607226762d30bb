"""A recording that shows that something is left out, and not what."""

from __future__ import annotations

from pathlib import Path

import pytest
from ladder import TACTICAL, record, ride
from ladder_sessions import tables
from session_folders import write_session

from fieldcal.core.samples import Block
from fieldcal.diagnosis.explain import Explanation, explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.diagnosis.verdict import make_diagnosis
from fieldcal.effects import catalogue
from fieldcal.session.folder import Session


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> tuple[Block, Explanation]:
    """A session with nothing in it, explained."""
    folder: Path = tmp_path_factory.mktemp("clean") / "s"
    said = tables(TACTICAL)
    write_session(folder, record(TACTICAL, ride(TACTICAL, 1, 0.0), ()),
                  said.pop("position"), **said)  # fmt: skip
    session = Session.open(folder)
    return session.block, explain(prepare_recording(session.block, session.about))


def weighed(explanation: Explanation, *shares: float) -> list[str]:
    """Give so much to the empty set and to sets of one effect; names of those."""
    posterior = explanation.posterior
    visited = list(posterior.sets.visited.values())
    empty = next(s for s in visited if not s.members)
    alone: dict[str, object] = {}
    for offer in posterior.search.offers.ranked(empty):
        name = offer.member[0].name
        if name in catalogue() and name not in alone:
            alone[name] = posterior.search.offers.accept(empty, offer)
        if len(alone) == len(shares) - 1:
            break
    sets = [empty, *alone.values()]
    posterior.__dict__["weights"] = list(zip(sets, shares, strict=True))
    return list(alone)


def test_what_cannot_be_named_is_not_called_nothing(
    clean: tuple[Block, Explanation],
) -> None:
    block, explanation = clean
    names = weighed(explanation, 0.4, 0.35, 0.2, 0.05)
    said = make_diagnosis(block, explanation)
    assert said.verdict == "ambiguous" and not said.effects
    assert said.probability == pytest.approx(0.6)
    assert "probability 0.60" in said.says
    assert f"{names[0]} (0.35), {names[1]} (0.20)." in said.says
    assert names[2] not in said.says, "too unlikely to be mentioned"
    assert "more positions" in said.next[0]


def test_what_is_likelier_not_there_is_called_nothing(
    clean: tuple[Block, Explanation],
) -> None:
    block, explanation = clean
    weighed(explanation, 0.51, 0.3, 0.19)
    said = make_diagnosis(block, explanation)
    assert said.verdict == "consistent"
    assert said.probability == pytest.approx(0.51)
    assert "Something" not in said.says and not said.next
