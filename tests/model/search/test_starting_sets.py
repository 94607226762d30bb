"""Where a search begins beside the nominal state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from small_sessions import LADDER, SD, G, Session, ladder, nominal, rows_of

from fieldcal.core.samples import Array, Index
from fieldcal.effects import catalogue
from fieldcal.model.causes.cause import Cause
from fieldcal.model.evidence.sets import Set
from fieldcal.model.priors import SIZES
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.starting_sets import (
    sets_with_large_turns,
    starting_sets,
    visible_angle,
)
from fieldcal.model.system.turn_rows import TurnRows
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.physics.effect import Sensor
from fieldcal.physics.experience import Experience

X = ladder()
NOTHING = np.zeros((len(X), 6))
USUAL = ("cross_coupling", "gyro_cross_coupling", "gyro_scale")
"""What every device has that was never calibrated."""


@pytest.mark.parametrize("name", ["base_step", "mount_slip"])
def test_a_turn_whose_square_shows_is_tried_about_its_own_state(name: str) -> None:
    """To either side; of those that say the same, the likeliest alone."""
    effect = catalogue()[name]
    assert isinstance(effect, Sensor)
    session = Session.of(X, ("base_step", "mount_slip", "bias_step:acc"))
    at = {"at_s": float(np.median(X.t))}
    for times in (8.0, -8.0, 0.1):
        size = times * np.rad2deg(visible_angle(session.search(NOTHING).sets.gram))
        values = np.r_[size, np.zeros(len(effect.params) - 1)]
        search = session.search(effect.change_of_outputs(X, values, at))
        found = list(sets_with_large_turns(search))
        if abs(times) < 1:
            assert not found
            continue
        (turned,) = found
        assert [m[0].key for m in turned.members] == [name]


@pytest.mark.parametrize(("times", "tried"), [(1.4, 1), (-1.4, 1), (0.7, 0)])
def test_a_position_at_another_angle_is_such_a_turn(times: float, tried: int) -> None:
    """Its columns are in rad; of the device's bias, a larger number, no angle comes."""
    session = Session.of(X, ("misset 4", "bias_step:acc"))
    angle = times * visible_angle(session.search(NOTHING).sets.gram)
    held = Experience.at_rest(X.alpha + angle * (X.position == 4), X.beta, G)
    off = np.hstack([held.f - X.f + 0.02, 0 * X.w])
    search = session.search(off)
    found = list(sets_with_large_turns(search))
    assert [sorted(one.keys) for one in found] == [["misset 4"]] * tried
    fit = GaussNewton(WindowSystem(rows_of(X, off), session.dictionary), nominal())
    begins = starting_sets(fit, search, search.sets.evaluate(()))
    assert [one.keys for one in begins] == [one.keys for one in found]


def test_an_angle_shows_if_its_square_turns_gravity_by_the_noise_of_a_mean() -> None:
    """Of the usual accelerometer that measured anything, whatever gyroscopes do."""
    gram = Session.of(X, ("bias_step:acc",)).gram(NOTHING)
    of_mean = SD[0] / np.sqrt(3)  # of three rows
    least = np.arccos(1 - of_mean / 9.80665)  # g (1 - cos) is lost along the force
    assert visible_angle(gram) == pytest.approx(least, rel=1e-4)
    info = gram.info.copy()
    info[:6, :3] = 0.0
    info[6, 0] *= 1e4
    assert visible_angle(replace(gram, info=info)) == pytest.approx(least, rel=1e-4)
    info[:, :3] = 0.0
    assert visible_angle(replace(gram, info=info)) == np.inf


def begun(
    keys: Sequence[str], held: Sequence[tuple[float, float]] = LADDER
) -> tuple[GaussNewton, Session]:
    """A fit and a session with some causes, of positions held at some angles, deg."""
    session = Session.of(X, keys)
    alpha, beta = np.deg2rad(held)[X.position].T
    y = np.hstack([Experience.at_rest(alpha, beta, G).f, X.w])
    fit = GaussNewton(WindowSystem(rows_of(X, y), session.dictionary), nominal())
    return fit, session


@pytest.mark.parametrize(
    ("held_as", "tried"),
    [
        ({}, False),
        ({2: 7, 7: 2}, True),
        ({0: 2, 2: 8, 8: 0}, True),
        # half of the eight that may be elsewhere: then it is the device that is
        ({0: 2, 2: 8, 6: 2, 7: 1}, False),
    ],
)
def test_positions_that_were_exchanged_are_tried_together(
    held_as: dict[int, int], tried: bool
) -> None:
    held = [LADDER[held_as.get(p, p)] for p in range(len(LADDER))]
    fit, session = begun([f"misset {p}" for p in (0, 1, 2, 3, 5, 6, 7, 8)], held)
    search = session.search(NOTHING)
    found = list(starting_sets(fit, search, search.sets.evaluate(())))
    expected = {f"misset {p}" for p in held_as}
    assert [set(one.keys) for one in found] == [expected] * tried


@pytest.mark.parametrize("gaps", [(), (100.0,), (100.0, 160.0)])
def test_a_restart_in_the_likeliest_of_the_gaps_is_tried(
    gaps: tuple[float, ...],
) -> None:
    """All biases jump, and the base, which may have been set up anew, does not."""
    session = Session.of(X, ("bias_step:acc", "bias_step:gyr", "base_step"))
    d = session.dictionary
    d.shown = np.ones(d.width, dtype=bool)
    instants = np.array(sorted({g.shape["at_s"] for g in d.causes[0].variants}))
    gaps = tuple(float(instants[np.argmin(np.abs(instants - gap))]) for gap in gaps)
    d.expect_within([(gap - 1e-3, gap + 1e-3) for gap in gaps])
    off = session.noise(np.random.default_rng(3))
    if gaps:
        off[X.t > gaps[-1]] += np.repeat([2e-2, 2e-3], 3)
    fit, _ = begun([])
    search = session.search(off)
    found = list(starting_sets(fit, search, search.sets.evaluate(())))
    jumps = [one for one in found if "bias_step:acc" in one.keys]
    assert len(jumps) == bool(gaps)
    for one in jumps:
        assert set(one.keys) == {"bias_step:acc", "bias_step:gyr"}
        assert all(group in cause.expected for cause, group in one.members)
        assert {g.shape["at_s"] for _, g in one.members} == {gaps[-1]}


def evaluated(session: Session, causes: Sequence[Cause]) -> Set:
    """The set of some causes, where nothing was recorded that they explain."""
    sets = session.search(NOTHING).sets
    return sets.evaluate(tuple((c, c.variants[0]) for c in causes))


@pytest.mark.parametrize(
    ("instability", "known", "tried"),
    [
        (1.0, (), False),
        (30.0, (), True),
        (30.0, ("cubic", *USUAL[:2]), True),
        (30.0, USUAL, False),
        (1.0, ("cubic",), False),
    ],
)
def test_a_large_instability_may_hide_what_every_device_has(
    instability: float, known: tuple[str, ...], tried: bool
) -> None:
    """On one output; causes that show only together."""
    fit, session = begun([*USUAL, "cubic"])
    causes = session.dictionary.causes
    best = evaluated(session, [c for c in causes if c.key in known])
    index = np.full(7, np.argmin(np.abs(SIZES - 1e-2)))
    index[1] = np.argmin(np.abs(np.log(SIZES / instability)))
    sizes = replace(best.sizes, instability=tuple(index.tolist()))
    search = session.search(NOTHING)
    found = list(starting_sets(fit, search, replace(best, sizes=sizes)))
    assert [set(one.keys) for one in found] == [set(USUAL)] * tried


@pytest.mark.parametrize(
    ("known", "moves", "tried"),
    [
        (("cubic",), "cubic", True),
        (("cubic",), "gyro_scale", False),  # the turn says nothing of it
        ((), "cubic", False),
        (USUAL[:2], "cross_coupling", False),
        ((*USUAL[:2], "cubic"), "cubic", True),
        ((*USUAL, "cubic"), "cubic", False),
    ],
)
def test_turns_that_unusual_causes_explain_may_be_explained_by_usual_ones(
    known: tuple[str, ...], moves: str, tried: bool
) -> None:
    """Where a column of such a cause changes the end of some turn."""
    fit, session = begun([*USUAL, "cubic"])
    causes = session.dictionary.causes
    columns = np.unique(np.concatenate([c.variants[0].columns for c in causes]))
    design = np.zeros((2, len(columns)))
    (own,) = (c.variants[0].columns for c in causes if c.key == moves)
    design[1, np.isin(columns, own)] = 0.3
    still = np.zeros_like(design)
    fit.turn_rows = [_turn(columns, still), _turn(columns, design)]
    best = evaluated(session, [c for c in causes if c.key in known])
    found = list(starting_sets(fit, session.search(NOTHING), best))
    assert [set(one.keys) for one in found] == [set(USUAL)] * tried


def _turn(columns: Index, design: Array) -> TurnRows:
    """A turn whose closure some columns change."""
    rows, nothing = len(design), np.zeros((0, len(columns)))
    return TurnRows(
        (0, 1), np.zeros(rows), columns, design, np.ones(rows), np.zeros((rows, 6)),
        np.zeros(0), nothing,
    )  # fmt: skip
