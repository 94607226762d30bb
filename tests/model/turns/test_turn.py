"""Turns of a virtual device with known errors, against what columns foretell."""

from __future__ import annotations

import sys
from copy import copy
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.fit import build_fit
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.model.causes.basis import RowView
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.filtered_turns import FILTERED
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.posterior.held_out import held_out_turn_residuals
from fieldcal.model.priors import SIZES
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.state import Term
from fieldcal.model.system.fitted import FittedSet
from fieldcal.model.system.linear_system import gram
from fieldcal.model.system.turn_force_rows import TurnForceRows
from fieldcal.model.system.turn_rows import TurnRows
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.model.turns.turn_tracker import TurnTracker
from fieldcal.session.description_file import parse_description
from fieldcal.sim_device.effect import SimulatedEffect
from fieldcal.sim_device.profile import (
    ONE,
    ZERO,
    Climate,
    NoiseFigures,
    Profile,
    Sampling,
    Truth,
)
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.sim_device.vocabulary import checked_effect

PLACES = ((0.0, 0.0), (60.0, 0.0), (60.0, -40.0), (-30.0, -40.0), (-30.0, 20.0),
          (20.0, 50.0))  # fmt: skip
"""Turned one joint after another, and last both at once, deg."""

SPACING_S, WINDOW_S, TURN_S = 12.0, 6.0, 3.0
QUIET = NoiseFigures(
    (1e-4,) * 3,
    (1e-6,) * 3,
    acc_instability=ZERO,
    gyr_instability=ZERO,
    temperature=0.0,
)
ERRORS = {
    "gyro_scale": {"s1": 2e-3, "s2": -1e-3, "s3": -3e-3},
    "gyro_cross_coupling": {"s12": 2e-3, "s31": -1e-3, "s23": 1.5e-3},
    "time_delay": {"seconds": 4e-3},
    "lever_arm": {"x": 0.01, "y": 0.02, "z": -0.03},
    "angle_offset": {"alpha0_deg": 0.1, "beta0_deg": -0.15},
}
every_error = pytest.mark.parametrize("name", ERRORS)


@dataclass(frozen=True)
class Ride:
    """A session of a device with one error.

    Attributes
    ----------
    fit : of its rows
    group, true : the error's columns, and their true values
    values : (k,) the same among all columns
    known : what windows say
    turns : rows about the nominal state

    """

    fit: GaussNewton
    group: Group
    true: Array
    values: Array
    known: Set
    turns: list[TurnRows]


def recorded(*errors: SimulatedEffect) -> tuple[Block, list[HeldWindow]]:
    """A device with some errors in all places."""
    starts = SPACING_S * np.arange(len(PLACES)) + 1.0
    angles = np.deg2rad(PLACES)
    windows = [
        HeldWindow(
            a, b, t, t + WINDOW_S, turn=None if t < 2 else (t - TURN_S - 1, t - 1)
        )
        for (a, b), t in zip(angles.tolist(), starts.tolist(), strict=True)
    ]
    device = Profile(
        truth=Truth(ZERO, ONE, ZERO, ONE),
        noise=QUIET,
        temperature=Climate(self_heating_k=0.0),
        sampling=Sampling(100.0),
        effects=errors,
    )
    return simulate(device, windows, seed=3), windows


def followed(
    block: Block, windows: list[HeldWindow], unit: Array | None = None
) -> tuple[GaussNewton, Set, list[TurnRows]]:
    """The fit of a ride, what windows say, and rows of turns about nominal."""
    places = [
        {"alpha_deg": a, "beta_deg": b, "start_s": w.start, "end_s": w.end}
        for (a, b), w in zip(PLACES, windows, strict=True)
    ]
    about = parse_description({
        "format": 1, "device": {"name": "turned"}, "position": places,
        "site": {"latitude_deg": 50.45, "height_m": 170.0},
    })  # fmt: skip
    if unit is not None:
        scaled = {"acc_scale": unit[:3], "gyr_scale": unit[3:]}
        about = replace(about, nominal={**about.nominal, **scaled})
        block = block.with_six(block.six * unit)
    prepared = prepare_recording(block, about)
    fit = build_fit(prepared)
    d, at_rest = fit.dictionary, np.zeros(fit.dictionary.width)
    linear = fit.system.linearised(fit.nominal)
    known = Sets(d, gram(linear, d, at_rest)).evaluate(())
    assert fit.turns is not None
    turns = fit.turns.linearised(fit.nominal, at_rest, linear, known)
    return fit, known, turns


@cache
def ride(name: str) -> Ride:
    fit, known, turns = followed(*recorded(checked_effect(name, ERRORS[name])))
    d = fit.dictionary
    group = next(c for c in d.causes if c.name == name).variants[0]
    assert group.effect is not None
    sizes = {
        key.removesuffix("_deg"): np.deg2rad(v) if key.endswith("_deg") else v
        for key, v in ERRORS[name].items()
    }
    names = [p.name.removesuffix("_deg") for p in group.effect.params]
    degrees = [p.unit == "deg" for p in group.effect.params]
    true = np.array([
        np.rad2deg(sizes.get(n, 0.0)) if deg else sizes.get(n, 0.0)
        for n, deg in zip(names, degrees, strict=True)
    ])  # fmt: skip
    values = np.zeros(d.width)
    values[group.columns] = true
    return Ride(fit, group, true, values, known, turns)


@every_error
def test_every_turn_is_followed(name: str) -> None:
    turns = ride(name).turns
    assert [t.positions for t in turns] == [(i, i + 1) for i in range(len(PLACES) - 1)]
    assert all(len(t.closure) == 3 for t in turns)


@every_error
def test_closures_are_what_the_columns_foretell(name: str) -> None:
    one, largest = ride(name), 0.0
    for turn in one.turns:
        predicted = turn.design @ one.values[turn.columns]
        size = np.linalg.norm(turn.closure)
        assert np.linalg.norm(turn.closure - predicted) < 0.006 * size + 1e-6
        largest = max(largest, float(size))
    shows = name not in ("time_delay", "lever_arm")  # these begin and end at rest
    assert (largest > 1e-3) == shows


@pytest.mark.parametrize("name", [n for n in ERRORS if n != "angle_offset"])
def test_the_way_is_what_the_columns_foretell(name: str) -> None:
    """To first order, and but for the noise."""
    one, largest = ride(name), 0.0
    for turn in one.turns:
        predicted = turn.way_design @ one.values[turn.columns]
        assert len(turn.way) > 50
        rest, size = np.linalg.norm(turn.way - predicted), np.linalg.norm(turn.way)
        assert rest < 0.02 * size + 1.4 * np.sqrt(len(turn.way))
        largest = max(largest, float(size))
    assert largest > 100


def test_what_two_windows_hide_is_no_filter(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cross-coupling is bias and scale factor in two windows, and shows on the way."""
    monkeypatch.setattr(sys.modules[__name__], "PLACES", ((0.0, 0.0), (45.0, 5.0)))
    coupled = checked_effect("cross_coupling", {"k31": 2e-3, "k12": -1e-3})
    fit, _, (turn,) = followed(*recorded(coupled))
    assert fit.dictionary.filters is not None
    squares = fit.dictionary.filters.columns[:2]
    seen = turn.way_design[:, np.isin(turn.columns, squares)]
    info = seen.T @ seen
    off = np.linalg.solve(info, seen.T @ turn.way)
    assert np.abs(off / np.sqrt(np.diag(np.linalg.inv(info)))).max() < 3
    assert turn.way @ turn.way < 1.5 * len(turn.way)


@pytest.mark.parametrize("name", ["gyro_scale", "gyro_cross_coupling"])
def test_about_the_true_state_there_is_nothing_left(name: str) -> None:
    one = ride(name)
    fit = one.fit
    term = Term(one.group.effect, one.true)  # type: ignore[arg-type]
    state = replace(fit.nominal, terms=(*fit.nominal.terms, term))
    linear = fit.system.linearised(state)
    assert fit.turns is not None
    for turn in fit.turns.linearised(state, one.values, linear, one.known):
        predicted = turn.design @ one.values[turn.columns]
        size = np.linalg.norm(turn.closure)
        assert np.linalg.norm(turn.closure - predicted) < 1e-4 * size + 1e-6


@pytest.mark.parametrize(
    ("acc", "gyr"),
    [
        (0.08, 0.08),
        pytest.param(0.0, 0.02, marks=pytest.mark.thorough),
        pytest.param(0.03, 0.03, marks=pytest.mark.thorough),
        pytest.param(0.02, 0.0, marks=pytest.mark.thorough),
    ],
)
def test_a_filter_is_what_its_columns_foretell(acc: float, gyr: float) -> None:
    """A low-pass of first order is late by tau; then follow tau^2, 2 tau^3, 3 tau^4.

    It bends the turn about two axes alone, and the forces on the way everywhere. There
    a filter of one triad is a delay first of all, whose own square is another column's.
    """
    low_pass = checked_effect("bandwidth", {"acc": acc, "gyr": gyr})
    fit, _, turns = followed(*recorded(low_pass))
    d = fit.dictionary
    filters = next(g for g in d.always if g.part == FILTERED)
    values = np.zeros(d.width)
    of_low_pass = [(tau**2, 2 * tau**3, 3 * tau**4) for tau in (acc, gyr)]
    values[filters.columns] = np.transpose(of_low_pass).ravel()
    *one_axis, both = turns
    off, predicted = both.closure, both.design @ values[both.columns]
    size = float(np.linalg.norm(off))
    np.testing.assert_allclose(predicted, off, atol=0.03 * size + 2e-6)
    assert (size > 1e-5) == (gyr > 0)
    for turn in one_axis:
        assert np.abs(turn.closure).max() < 4e-6
        assert np.abs(turn.design @ values[turn.columns]).max() < 4e-6
    for turn in turns if acc == gyr else ():
        predicted = turn.way_design @ values[turn.columns]
        rest, seen = np.linalg.norm(turn.way - predicted), np.linalg.norm(turn.way)
        assert seen > 25 and rest < 0.02 * seen + 1.4 * np.sqrt(len(turn.way))


def test_the_way_agrees_where_the_state_lacks_what_the_factory_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Beside what the factory left, bias and scale factor are others than without."""
    monkeypatch.setattr(sys.modules[__name__], "PLACES", ((0.0, 0.0), (45.0, 5.0)))
    left = {"k31": 2e-3, "k12": -1e-3, "k23": 2e-3}
    fit, _, _ = followed(*recorded(checked_effect("cross_coupling", left)))
    state, values, best = fit.settle(fit.nominal, np.zeros(fit.dictionary.width), ())
    assert fit.turns is not None and not best.members
    linear = fit.system.linearised(state)
    (turn,) = fit.turns.linearised(state, values, linear, best)
    assert len(turn.way) > 50 and turn.way @ turn.way < 1.5 * len(turn.way)


def test_two_terms_of_one_effect_are_told_apart() -> None:
    """A step of both triads is two terms; what one puts on the way is not the other."""
    one = ride("gyro_scale")
    fit, effect = one.fit, one.group.effect
    assert effect is not None and fit.turns is not None
    terms = (Term(effect, np.full(3, 2e-3)), Term(effect, np.full(3, 1e-3)))
    state = replace(fit.nominal, terms=terms)
    turns = fit.turns_at(state)
    both, first, second = (
        list(fit.turns.outputs_of_terms(turns, state, some))
        for some in (terms, terms[:1], terms[1:])
    )
    for whole, larger, smaller in zip(both, first, second, strict=True):
        np.testing.assert_allclose(larger, 2 * smaller, rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose(whole, larger + smaller, rtol=1e-9, atol=1e-15)
        assert np.abs(smaller).max() > 1e-5


def test_what_an_arm_puts_on_the_way_is_what_turns_make_of_it() -> None:
    """w x (w x r) + w' x r, and of the other causes of a state nothing."""
    one, arm = ride("lever_arm"), np.array([0.02, -0.01, 0.03])
    fit = one.fit
    assert one.group.effect is not None
    causes = {c.name: c for c in fit.dictionary.causes}
    scale = causes["gyro_scale"].variants[0]
    assert scale.effect is not None
    terms = (Term(scale.effect, np.full(3, 2e-3)), Term(one.group.effect, arm))
    state = replace(fit.nominal, terms=terms)
    turns = fit.turns_at(state)
    assert len(turns) == len(PLACES) - 1
    for name, group in (("lever_arm", one.group), ("gyro_scale", scale)):
        found = fit.outputs_in_turns(turns, state, [(causes[name], group)])
        for turn, out in zip(turns, found, strict=True):
            w, change = turn.x.w, turn.x.w_dot
            expected = np.zeros((len(w), 6))
            if name == "lever_arm":
                around = np.cross(w, np.cross(w, arm)) + np.cross(change, arm)
                expected[:, :3] = around
            else:
                expected[:, 3:] = 2e-3 * w
            np.testing.assert_allclose(out, expected, atol=1e-9)
            assert np.abs(expected).max() > 1e-4
    for out in fit.outputs_in_turns(turns, state, []):
        np.testing.assert_allclose(out, 0.0, atol=1e-12)


def test_turns_are_followed_to_another_state_without_the_way() -> None:
    one = ride("gyro_scale")
    fit = one.fit.independent_copy(one.turns)
    assert fit.turn_rows == one.turns and fit.turns_at(fit.nominal) == []
    fit.follow_turns(fit.nominal, one.values)
    assert fit.turn_rows == one.turns, "it has no recording of turns"
    assert list(fit.outputs_in_turns([], fit.nominal, [])) == []
    fit = one.fit
    term = Term(one.group.effect, one.true)  # type: ignore[arg-type]
    state = replace(fit.nominal, terms=(*fit.nominal.terms, term))
    fit.follow_turns(state, one.values)
    largest = 0.0
    for turn, before in zip(fit.turn_rows, one.turns, strict=True):
        assert not len(turn.way) and turn.positions == before.positions
        predicted = turn.design @ one.values[turn.columns]
        size = np.linalg.norm(turn.closure)
        assert np.linalg.norm(turn.closure - predicted) < 1e-4 * size + 1e-6
        largest = max(largest, float(size))
    assert largest > 1e-3


def test_no_turn_begins_or_ends_where_the_force_points_nowhere() -> None:
    """As in a window of unknown orientation of which no sample can be used."""
    turns = ride("gyro_scale").fit.turns
    assert turns is not None
    rows = turns.tracker.rows
    unknown = rows.x.position == 2
    x = replace(rows.x, f=np.where(unknown[:, None], 0.0, rows.x.f))
    tracker = TurnTracker(turns.tracker.source, replace(rows, x=x), turns.tracker.since)
    assert [pair for pair, *_ in tracker.legs] == [(0, 1), (3, 4), (4, 5)]


def test_the_unit_of_outputs_changes_neither_turns_nor_evidence() -> None:
    """Not even where gyroscopes have another one than accelerometers."""
    unit = np.repeat([2.0, 8.0], 3)
    ridden = recorded(checked_effect("gyro_scale", ERRORS["gyro_scale"]))
    (fit, known, turns), (other, again, found) = (
        followed(*ridden, scale) for scale in (None, unit)
    )
    assert again.score == pytest.approx(known.score, rel=1e-9)
    for turn, before in zip(found, turns, strict=True):
        np.testing.assert_allclose(turn.info, before.info, rtol=1e-6)
        np.testing.assert_allclose(turn.closure, before.closure, atol=1e-9)
        np.testing.assert_allclose(turn.way, before.way, atol=1e-3)
    keys = {c.key for c in fit.dictionary.causes}
    assert {c.key for c in other.dictionary.causes} == keys
    causes = {c.key: c for c in other.dictionary.causes}
    for cause in fit.dictionary.causes:
        if cause.name.startswith("gyro_"):
            group, scaled = cause.variants[0], causes[cause.key].variants[0]
            np.testing.assert_allclose(scaled.typical, 8.0 * group.typical)


def test_information_of_closures_is_that_of_noise() -> None:
    """Of white noise over the turn, and of nothing that is not there."""
    for turn in ride("gyro_scale").turns:
        length = TURN_S + 2.0  # with some time before and after
        sigma = QUIET.gyr[0] * np.sqrt(length / 100.0)
        np.testing.assert_allclose(1 / np.sqrt(turn.info), sigma, rtol=0.3)


def test_noise_of_gyroscopes_counts_by_their_scale_factor() -> None:
    """Outputs of twice the rate with the same noise tell the angle twice as well."""
    block, windows = recorded()
    block = replace(block, gyr=2.0 * block.gyr + QUIET.gyr[0] * np.random.default_rng(
        1).standard_normal(block.gyr.shape))  # fmt: skip
    places = [
        {"alpha_deg": a, "beta_deg": b, "start_s": w.start, "end_s": w.end}
        for (a, b), w in zip(PLACES, windows, strict=True)
    ]
    about = {"format": 1, "position": places, "nominal": {"gyr_scale": [2.0] * 3}}
    prepared = prepare_recording(block, parse_description(about))
    fit = build_fit(prepared)
    d, at_rest = fit.dictionary, np.zeros(fit.dictionary.width)
    linear = fit.system.linearised(fit.nominal)
    assert fit.turns is not None and not d.unoriented.any()
    turns = fit.turns.linearised(fit.nominal, at_rest, linear, None)
    noise = float(np.sqrt((prepared.rows.noise[3:] ** 2).mean()))
    for turn in turns:
        sigma = noise / 2.0 * np.sqrt((TURN_S + 2.0) / 100.0)
        np.testing.assert_allclose(1 / np.sqrt(turn.info), sigma, rtol=0.3)
        assert not len(turn.way), "what windows say is not known yet"


def test_noise_of_gyroscopes_on_the_way_is_a_bridge_between_windows() -> None:
    """(1) of `turn_force_rows`, against walks drawn and carried along the turn."""
    one = ride("gyro_scale")
    fit, state = one.fit, one.fit.nominal
    assert fit.turns is not None
    turning = fit.turns.tracker
    turn = next(iter(turning.turns(state)))
    since = turning.time_since_turn(turn.x.t, turn.positions[1])
    view, noise = RowView(turn.x, turn.x, since, state), np.repeat([0.0, 1e-2], 3)
    found = TurnForceRows(turn, view, fit.dictionary, one.known, noise)._covariance()
    rng, gaps = np.random.default_rng(1), np.diff(turn.x.t)
    density = noise[3] * np.sqrt(turn.interval)
    steps = density * rng.standard_normal((1500, len(gaps), 3)) * gaps[:, None] ** 0.5
    phi = np.concatenate([np.zeros((1500, 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    phi -= turn.done[:, None] * phi[:, -1:]
    rows = turn.means(turn.force_error(np.moveaxis(phi, 0, 2)))
    spread = np.cov(rows.reshape(-1, 1500))
    sizes = SIZES[list(one.known.sizes.instability)][:3]
    loose = sizes * fit.dictionary.typical_instability[:3]
    cov = found - np.diag((turn.sd**2).ravel())
    own = np.diag(cov).reshape(-1, 3) - 2 * loose**2
    drawn = np.diag(spread).reshape(-1, 3)
    some = drawn > 0.3 * drawn.max()  # at the ends a piece is no instant
    np.testing.assert_allclose(own[some], drawn[some], rtol=0.15)
    size = np.sqrt(np.diag(spread)) + 1e-12
    middle = (turn.x.t[turn.cut[1:]] + turn.x.t[turn.cut[:-1]]) / 2
    course = 1 + np.exp(-(np.subtract.outer(middle, middle) ** 2) / 8.0)
    rest = cov - np.kron(course, np.diag(loose**2)) - spread
    there = np.flatnonzero(some.ravel())
    off = (rest / np.outer(size, size))[np.ix_(there, there)]
    assert np.abs(off).max() < 0.15


def test_turns_are_foretold_from_windows_and_the_other_turns() -> None:
    """With the scale factors in the set: without them a closure is far off."""
    one = ride("gyro_scale")
    fit, d = one.fit, one.fit.dictionary
    assert isinstance(fit.system, WindowSystem)
    linear = fit.system.linearised(fit.nominal)
    at_rest = np.zeros(d.width)
    rows = gram(linear, d, at_rest, one.turns)
    cause = next(c for c in d.causes if c.name == "gyro_scale")
    sets = Sets(d, rows)
    missed = []
    for members in ((), ((cause, one.group),)):
        there = sets.evaluate(members)
        fitted = FittedSet(fit.system.rows, d, linear, at_rest, there)
        missed.append(held_out_turn_residuals(fitted, one.turns))
    assert len(missed[0]) == sum(len(t.closure) + len(t.way) for t in one.turns)
    before, after = (np.sqrt(np.mean(m**2)) for m in missed)
    assert after < 0.1 * before


def test_a_copied_column_is_as_the_one_it_is_near() -> None:
    turn = ride("gyro_scale").turns[2]
    old, new = turn.columns[[1, 4]], np.array([9001, 9002])
    more = turn.with_copied_columns(old, new)
    np.testing.assert_array_equal(more.columns[-2:], new)
    for was, found in ((turn.design, more.design), (turn.way_design, more.way_design)):
        np.testing.assert_array_equal(found[:, -2:], was[:, [1, 4]])
        np.testing.assert_array_equal(found[:, :-2], was)


def test_the_time_since_a_turn_counts_from_where_it_ends() -> None:
    fit = ride("gyro_scale").fit
    assert fit.turns is not None
    turning, x = fit.turns.tracker, fit.dictionary.x
    first = int(np.argmax(x.position == 2))
    ended = x.t[first] - fit.dictionary.since[:, first]
    since = turning.time_since_turn(
        np.array([ended[0] - 0.5, ended[0], ended[0] + 2.0]), 2
    )
    np.testing.assert_allclose(since[0], [np.inf, 0.0, 2.0], atol=1e-9)
    assert abs(ended[0] - (2 * SPACING_S)) < 0.7


def test_on_the_way_the_clock_of_the_session_goes_on() -> None:
    fit = ride("gyro_scale").fit
    assert fit.turns is not None
    tracker = fit.turns.tracker
    source = replace(tracker.source)
    later = replace(source, block=replace(source.block, t=source.block.t + 500.0))
    tracker = copy(tracker)
    tracker.source = later
    for turn in tracker.turns(fit.nominal):
        np.testing.assert_allclose(
            turn.x.since_start, turn.t - 500.0 - source.block.t[0]
        )
        middle = (turn.t[0] + turn.t[-1]) / 2 - 500.0
        assert abs((middle - 1.0) % SPACING_S - 9.0) < 1.5, "between two windows"
        assert np.isinf(turn.x.since_turn).all()
        assert (turn.x.position == -1).all()


def test_a_gyroscope_that_is_off_on_the_way_bends_a_turn_as_its_bias_does() -> None:
    """Biases that wander from window to window are not those of the way either."""
    one = ride("gyro_scale")
    d = one.fit.dictionary
    for turn in one.turns:
        whole = np.zeros((len(turn.closure), d.width))
        whole[:, turn.columns] = turn.design
        drift = np.abs(whole[:, d.bias + np.arange(3, 6)])
        assert drift.max() > 1.0, "s, as long as the way"
        np.testing.assert_allclose(
            turn.closure_errors[:, 3:], drift, rtol=1e-6, atol=1e-9
        )


def test_what_windows_are_off_by_bends_a_turn_as_a_bias_does() -> None:
    """Without known angles a closure begins and ends at the forces that are seen."""
    block, windows = recorded()
    places = [{"start_s": w.start, "end_s": w.end} for w in windows]
    prepared = prepare_recording(
        block, parse_description({"format": 1, "position": places})
    )
    fit = build_fit(prepared)
    d, at_rest = fit.dictionary, np.zeros(fit.dictionary.width)
    linear = fit.system.linearised(fit.nominal)
    assert fit.turns is not None and d.unoriented.all()
    turns = fit.turns.linearised(fit.nominal, at_rest, linear, None)
    assert len(turns) > 3
    for turn in turns:
        whole = np.zeros((len(turn.closure), d.width))
        whole[:, turn.columns] = turn.design
        for c in range(3):
            each = whole[
                :,
                d.windows
                + c * len(d.window_positions)
                + np.arange(len(d.window_positions)),
            ]
            assert np.flatnonzero(each.any(axis=0)).tolist() == list(turn.positions)
            for found, expected in (
                (each.sum(axis=1), whole[:, d.bias + c]),
                (np.linalg.norm(each, axis=1), turn.closure_errors[:, c]),
            ):
                np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)
