"""Logs of a device that nobody fixed: far from nominal, in orientations not known."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from benchmarks.hand_held.draws import GRAVITY, log
from fieldcal.cli import main
from fieldcal.diagnosis.explain import Explanation, explain
from fieldcal.diagnosis.fit import build_fit
from fieldcal.diagnosis.prepare import PreparedRecording, prepare_recording
from fieldcal.model import thresholds
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.evidence.sizing import UNIT_INDEX, Sizes
from fieldcal.session.folder import Session

EVERY = {"cross_coupling", "gyro_cross_coupling", "gyro_scale"}
SEEDS = (88_000_036, pytest.param(88_000_011, marks=pytest.mark.thorough))


@cache
def prepared(seed: int) -> PreparedRecording:
    """A log as `fieldcal import` makes a session of it."""
    head = "t,ax,ay,az,gx,gy,gz,temp"
    with TemporaryDirectory() as folder:
        file, one = Path(folder) / "log.csv", Path(folder) / "s"
        np.savetxt(file, log(seed).rows, "%.6f", ",", header=head, comments="")
        assert main(["import", str(file), "-o", str(one)]) == 0
        said = (one / "session.toml").read_text()
        said = said.replace("[site]", f"[site]\ngravity = {GRAVITY}")
        (one / "session.toml").write_text(said)
        session = Session.open(one)
        return prepare_recording(session.block, session.about)


@cache
def explained(seed: int) -> Explanation:
    """A log, explained."""
    return explain(prepared(seed))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", SEEDS)
def test_three_effects_are_found_of_which_none_is_seen_alone(seed: int) -> None:
    """What bends |f| bends the turns as well, until accelerometers are set right."""
    found = explained(seed)
    assert {one.name for one in found.probable_causes} == EVERY
    assert found.posterior.probability_of_noise_alone < 1e-6


@pytest.mark.thorough
def test_the_state_stays_where_the_set_does() -> None:
    """Another step about rows of turns that are linearised there is a small one."""
    inferred = explained(88_000_036).inferred
    own, best = inferred.fit, inferred.best
    own.gram(inferred.state, inferred.values, None)
    _, moved, _ = own.settle(inferred.state, inferred.values, best.members, best.sizes)
    assert own.largest_step(best, inferred.values, moved) < thresholds.VISIBLE


def test_how_a_position_lies_moves_no_closure() -> None:
    """It is read from accelerometers, whatever they couple, bend or are biased by."""
    one = prepared(88_000_045)
    own = build_fit(one)
    there = {c.key: c for c in own.dictionary.causes}
    state, values, _ = own.settle(own.nominal, np.zeros(own.dictionary.width), ())
    members = tuple((there[key], there[key].variants[0]) for key in sorted(EVERY))
    state, values, _ = own.settle(state, values, members)
    own.gram(state, values, None)
    coupled = [t for t in state.terms if t.effect.id == "cross_coupling"]
    assert np.abs(np.concatenate([t.values for t in coupled])).max() > 4e-3
    lies = np.arange(own.dictionary.width)[own.dictionary.rotations]
    moved = [t.design[:, np.isin(t.columns, lies)] for t in own.turn_rows]
    assert len(moved) > 5
    assert max(np.abs(m).max(initial=0.0) for m in moved) < 1e-6


@pytest.mark.thorough
def test_sizes_do_not_hang_on_where_they_begin() -> None:
    """Of |f| each axis alone may do without its scatter, all three together not."""
    found = explained(88_001_001)
    assert "temperature_bias" in {one.name for one in found.probable_causes}
    dictionary, gram = found.dictionary, found.inferred.search.sets.gram
    causes = {cause.key: cause for cause in dictionary.causes}
    even = (UNIT_INDEX,) * len(dictionary.always)
    for key in ("temperature_bias:gyr", "bias_drift:gyr", "cross_coupling"):
        member = causes[key], causes[key].variants[0]
        starts = [
            None,
            *(Sizes(even, (n,) * 3 + (0,) * 4, (UNIT_INDEX,)) for n in (24, 29)),
        ]
        scores = [
            Sets(dictionary, gram).evaluate((member,), start).score for start in starts
        ]
        assert max(scores) - min(scores) < 5.0
