"""Sessions of the virtual device, and what the state that was found leaves of them."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from small_sessions import Session as SmallSession
from small_sessions import ladder

from benchmarks.concealed import kinds
from benchmarks.concealed.draws import sized
from benchmarks.concealed.sessions import Session, plain
from fieldcal.diagnosis.explain import explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.search import inference
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.inference import Inference, resume
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State
from fieldcal.model.system.fitted import estimates_by_column

FADING = {
    "warm_up": {"ax": 0.01, "ay": 0.004, "az": -0.008, "tau_s": 143.0},
    "settling": {"ax": 0.01, "ay": 0.004, "az": -0.008, "tau_s": 6.1},
}


@pytest.mark.parametrize("known", [True, False])
def test_rows_are_linearised_with_the_set_that_is_known(known: bool) -> None:
    """Forces during turns are used beside a set that the windows were fitted to."""
    small = SmallSession.of(ladder(), ("bias_drift:acc",))
    made = small.search(small.noise(np.random.default_rng(1))).sets
    there = made.evaluate(()) if known else None
    asked: list[Any] = []

    class Rows:
        dictionary = made.dictionary

        def gram(self, *about: Any) -> Gram:
            asked.append(about)
            return made.gram

    state, values = cast(State, object()), np.zeros(2)
    search = Inference(cast(GaussNewton, Rows()))._search_about(state, values, there)
    ((about, at, held),) = asked
    assert about is state and at is values and held is there
    assert search.sets.gram is made.gram


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "sessions"),
    [
        ("settling", 1),
        pytest.param("settling", 2, marks=pytest.mark.thorough),
        pytest.param("warm_up", 2, marks=pytest.mark.thorough),
    ],
)
def test_the_way_is_left_with_its_noise_beside_what_fades(
    name: str, sessions: int
) -> None:
    """A time constant between the points of the grid; chi2 over several sessions."""
    square, freedom = 0.0, 0
    for seed in range(sessions):
        session = _having(name, seed)
        found = explain(prepare_recording(session.record(seed), session.about))
        assert [one.name for one in found.probable_causes] == [name]
        values = estimates_by_column(found.inferred.best.state, found.dictionary)
        for turn in found.inferred.turn_rows:
            left = turn.way - turn.way_design @ values[turn.columns]
            square, freedom = square + float(left @ left), freedom + len(left)
    assert freedom > 350 * sessions
    assert abs(square - freedom) < 5 * np.sqrt(2 * freedom)


def _having(name: str, seed: int) -> Session:
    session = plain(np.random.default_rng(seed), ("wide",))
    values = sized(session, name, FADING[name], 30.0)
    assert values is not None
    return session.having({name: values})


@pytest.mark.thorough
def test_the_earth_s_upright_rate_is_no_g_sensitivity() -> None:
    """Where orientations are not known it follows the force, and is the Earth's."""
    draw, _ = kinds()["cross_coupling"]
    session = draw(np.random.default_rng(32_002_000))
    assert not session.angles
    found = explain(prepare_recording(session.record(32_002_000), session.about))
    assert [one.name for one in found.probable_causes] == ["cross_coupling"]


def test_what_another_start_led_to_is_compared_at_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Not the likeliest by itself, it may be hardly less likely than what is."""
    session = plain(np.random.default_rng(4), ("wide",))
    there: list[Set] = []

    def starts(_: GaussNewton, search: Search, __: Set) -> Iterator[Set]:
        causes = {c.key: c for c in search.sets.dictionary.causes}
        drift = causes["bias_drift:acc"]
        there.append(search.sets.evaluate(((drift, drift.variants[0]),)))
        yield there[0]

    monkeypatch.setattr(inference, "starting_sets", starts)
    monkeypatch.setattr(Search, "_with_one_replaced", lambda _, current: current)
    found = explain(prepare_recording(session.record(4), session.about)).inferred
    assert not found.best.members
    assert Sets.key(there[0].members) in found.search.sets.visited


@pytest.mark.thorough
def test_what_was_gone_through_is_not_gone_through_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The first set that is found ends it, where what follows from that is known."""
    rng = np.random.default_rng(1)
    session = plain(rng, ("wide",)).having({"cross_coupling": {"k12": 0.006}})
    found = explain(prepare_recording(session.record(1), session.about)).inferred
    assert found.best.keys == {"cross_coupling"}
    assert Sets.key(found.best.members) in found.visited_keys
    runs: list[Set] = []
    run = Search.run

    def kept(self: Search, *known: Any, **more: Any) -> Set:
        runs.append(run(self, *known, **more))
        return runs[-1]

    monkeypatch.setattr(Search, "run", kept)
    nothing = found.search.sets.evaluate(())
    again = resume(nothing, replace(found, visited_keys=frozenset()))
    assert again.best.keys == found.best.keys and len(runs) > 1
    first = Sets.key(runs[0].members)
    runs.clear()
    ended = resume(nothing, replace(found, visited_keys=frozenset({first})))
    assert [Sets.key(one.members) for one in runs] == [first]
    assert Sets.key(ended.best.members) == first
