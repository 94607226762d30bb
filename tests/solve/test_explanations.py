"""What a recording shows, in a given set: the mean over explanations, at the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from observed import BIAS, SCALE, observe, outputs

from fieldcal.calibration.names import TILTS
from fieldcal.core.positions import SIX_FACES, Position
from fieldcal.model.causes.effect_causes import effect_causes
from fieldcal.model.causes.random_causes import random_causes
from fieldcal.model.causes.unknown_causes import unknown_causes
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.state import State
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.solve import Observations
from fieldcal.solve.estimation import (
    ParameterEstimate,
    RecordedRows,
    estimate_parameters,
)
from fieldcal.solve.explanations import WeightedExplanation
from fieldcal.solve.observation_rows import rows_of_observations
from fieldcal.solve.parameter_set import ParameterSet, ParameterSetOptions
from fieldcal.solve.variants import spread_points, variants

PLACES = (
    *SIX_FACES,
    *(Position.deg(a, b) for a, b in [(45, 0), (-45, 0), (0, 45), (45, 35), (0, 0)]),
)
TIMES = 40.0 * np.arange(len(PLACES))
DRIFT = 2e-5
NOMINAL = State(
    np.zeros(6), np.ones(6), np.zeros((len(PLACES), 2)), np.zeros(3)
)  # fmt: skip


def seen(drift: float = DRIFT, noise: int | None = None) -> Observations:
    """Windows of a device whose bias of x drifts."""
    acc = outputs(PLACES)
    acc[:, 0] += drift * TIMES
    if noise is not None:
        acc += np.random.default_rng(noise).normal(0.0, 1e-3, acc.shape)
    return replace(observe(PLACES, acc), time=TIMES)


def recording(drift: float = DRIFT, noise: int | None = None) -> RecordedRows:
    """Its rows, with the time since the start."""
    return rows_of_observations(seen(drift, noise))


def given(shown: Sequence[WeightedExplanation] = ()) -> ParameterSet:
    recorded = recording()
    return ParameterSet(
        recorded.rows,
        np.ones(6),
        recorded.since_turn,
        False,
        ParameterSetOptions(),
        shown,
    )


def member(name: str, params: tuple[int, ...] | None = None) -> Member:
    """A cause of the accelerometers, by the columns of a dictionary of its own."""
    d = given()
    (cause,) = [
        c
        for c in (*effect_causes(d), *random_causes(d))
        if (c.name, c.part) == (name, "acc")
    ]
    return next((cause, g) for g in cause.variants if params in (None, g.params))


def fitted(
    shown: Sequence[WeightedExplanation], noise: int | None = None
) -> ParameterEstimate:
    recorded = replace(recording(noise=noise), explanations=tuple(shown))
    return estimate_parameters(recorded, None, NOMINAL, ParameterSetOptions())


def test_explanations_that_differ_in_nothing_that_is_carried_are_one() -> None:
    drift = member("bias_drift")
    d = given(
        [
            WeightedExplanation((drift,), 0.5),
            WeightedExplanation((), 0.2),
            WeightedExplanation((drift,), 0.3),
        ]
    )
    assert [len(s.members) for s in d.explanations] == [1, 0]
    assert [s.probability for s in d.explanations] == pytest.approx([0.8, 0.2])


@pytest.mark.parametrize("name", ["bias_drift", "random_walk"])
def test_a_cause_is_as_large_as_its_likeliest_explanation_has_it(name: str) -> None:
    """In all its variants; one whose size nobody tells has that of its rows."""
    one = member(name)
    shown = [
        WeightedExplanation((one,), 0.3, sizes=(2.0,)),
        WeightedExplanation((one,), 0.7, sizes=(5.0,)),
    ]
    ((cause, group),) = given(shown).explanations[0].members
    assert {g.fixed_size for g in (*cause.variants, group)} == {5.0}
    assert group in cause.variants
    ((cause, group),) = (
        given([WeightedExplanation((one,), 1.0)]).explanations[0].members
    )
    assert {g.fixed_size for g in (*cause.variants, group)} == {None}


def test_a_restart_is_carried_with_the_jump_that_it_had() -> None:
    """Of the three sizes, wherever they are in memory, and each in the set once."""
    cause, first = member("bias_step", (0, 1, 2))
    (at_s,) = first.shape.values()
    cause = cause.expecting_within([(at_s - 1e-3, at_s + 1e-3)])
    jumps = [g for g in cause.variants if g in cause.expected]
    shown = [
        WeightedExplanation(((cause, g),), p, sizes=(1.0,))
        for g, p in zip(jumps, (0.2, 0.5, 0.3), strict=True)
    ]
    found = given(shown).explanations
    assert [s.probability for s in found] == pytest.approx([0.5, 0.3, 0.2])
    for one, jump in zip(found, (jumps[1], jumps[2], jumps[0]), strict=True):
        ((same, group),) = one.members
        np.testing.assert_allclose(group.own_sigma(), jump.own_sigma())
        assert group in same.expected and group.shape == jump.shape
        assert len(same.expected) == len(jumps)


def test_what_is_uncertain_beside_a_cause_does_not_make_it_smaller() -> None:
    """Badly set angles hide a drift: its size is the one found, and not the least."""

    truth = BIAS[0] + DRIFT * TIMES[-1]

    def off(sizes: tuple[float, ...], seed: int) -> float:
        shown = (WeightedExplanation((member("bias_drift", (0,)),), 1.0, sizes=sizes),)
        recorded = replace(recording(noise=seed), explanations=shown)
        found = estimate_parameters(
            recorded, None, NOMINAL, ParameterSetOptions(angles_deg=0.1)
        )
        at = found.names.index("acc_bias.x")
        assert (
            abs(float(found.values[at]) - truth) < 2 * found.covariance[at, at] ** 0.5
        )
        return float(abs(found.values[at] - truth))

    as_found, sought = (
        np.mean([off(sizes, seed) for seed in range(4)]) for sizes in ((4.0,), ())
    )
    assert as_found < 0.8 * sought


def test_one_that_hardly_can_be_is_left_out_and_so_is_what_the_set_has() -> None:
    drift = member("bias_drift")
    unlikely = given(
        [WeightedExplanation((drift,), 0.002), WeightedExplanation((), 0.998)]
    )
    assert [s.probability for s in unlikely.explanations] == [1.0]
    d = given()
    (cause,) = [c for c in effect_causes(d) if c.name == "base_tilt"]
    shown = [WeightedExplanation(((cause, cause.variants[0]),), 1.0)]
    rows = recording()
    same = ParameterSet(
        rows.rows,
        np.ones(6),
        rows.since_turn,
        False,
        ParameterSetOptions("angle_offset"),
        shown,
    )
    assert not same.explanations[0].members


def test_a_tilt_is_carried_beside_the_other_one_where_both_are_shown() -> None:
    d, rows = given(), recording()
    both = {c.name: (c, c.variants[0]) for c in effect_causes(d) if c.name in TILTS}
    for names, carried in ((TILTS, ["base_tilt"]), (("base_tilt",), [])):
        shown = [WeightedExplanation(tuple(both[name] for name in names), 1.0)]
        wanted = ParameterSetOptions("angle_offset")
        found = ParameterSet(
            rows.rows, np.ones(6), rows.since_turn, False, wanted, shown
        )
        assert [c.name for c, _ in found.explanations[0].members] == carried


def test_windows_that_are_off_each_for_itself_are_no_cause_of_a_set() -> None:
    """It has those already, as windows that scatter or may be bad."""
    d = given()
    every = [*random_causes(d), *unknown_causes(d)]
    for name in ("window", "position"):
        cause = next(c for c in every if c.name == name)
        shown = given(
            [
                WeightedExplanation(((cause, cause.variants[0]),), 0.9),
                WeightedExplanation((), 0.1),
            ]
        )
        assert [s.members for s in shown.explanations] == [()]
        assert shown.explanations[0].probability == pytest.approx(1.0)
    (angles,) = (c for c in every if c.name == "angle_setting")
    shown = given([WeightedExplanation(((angles, angles.variants[0]),), 1.0)])
    assert shown.explanations == (WeightedExplanation((), 1.0),), (
        "how well they are set is in"
    )
    assert given().explanations == (WeightedExplanation((), 1.0),)


def test_a_position_that_was_set_wrongly_is_carried() -> None:
    """Axes that may be out of square hide it from a set of six faces."""
    cause = next(c for c in random_causes(given()) if c.key == "misset 3")
    shown = given(
        [
            WeightedExplanation(((cause, cause.variants[0]),), 0.9),
            WeightedExplanation((), 0.1),
        ]
    )
    assert [s.probability for s in shown.explanations] == pytest.approx([0.9, 0.1])
    ((same, group),) = shown.explanations[0].members
    assert (same.name, group.position) == ("misset", 3)


def test_functions_without_physics_are_carried_by_their_place() -> None:
    d = given()
    cause = next(c for c in unknown_causes(d) if c.key == "time:ay")
    shown = given([WeightedExplanation(((cause, cause.variants[2]),), 1.0)])
    ((same, group),) = shown.explanations[0].members
    assert same.key == "time:ay" and group.shape == cause.variants[2].shape
    assert same.kind == "unknown"
    ends = shown.end_values.bias
    assert np.flatnonzero(ends.any(axis=1)).tolist() == [1]
    expected = (-1.0) ** np.arange(1, len(group.columns) + 1)
    np.testing.assert_allclose(ends[1, group.columns], expected)


def test_a_scale_factor_that_changes_has_its_value_at_the_end() -> None:
    """Of a function of force and time: at the end every Legendre polynomial is 1."""
    d = given()
    cause = next(c for c in unknown_causes(d) if c.key == "force and time:ax")
    shown = given([WeightedExplanation(((cause, cause.variants[1]),), 1.0)])
    ((_, group),) = shown.explanations[0].members
    bias, scale = shown.end_values.bias_scale
    assert not bias.any()
    np.testing.assert_allclose(scale[0, group.columns], 1 / 9.81, rtol=1e-6)
    assert np.count_nonzero(scale) == len(group.columns)


def test_an_effect_of_one_triad_may_be_on_the_other_as_well() -> None:
    shown = given([WeightedExplanation((member("bias_drift"),), 1.0)])
    (one,) = shown.explanations
    assert one.possible_members == (), "no gyroscopes were measured"
    ((cause, group),) = one.members
    params = {g.params for g in cause.variants}
    assert params == {(0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)}
    assert group is cause.variants[0]


def test_the_bias_is_that_at_the_end() -> None:
    """Of a drift, what it has come to, and what scale factors have beside it."""
    d = given([WeightedExplanation((member("bias_drift"),), 1.0)])
    ((_, group),) = d.explanations[0].members
    bias, scale = d.end_values.bias_scale
    for j, column in zip(group.params, group.columns, strict=True):
        assert bias[j, column] == pytest.approx(TIMES[-1])
    assert np.count_nonzero(bias) == len(group.params)
    ((_, beside),) = (
        set(d.members) - set(d.base_members) - set(d.explanations[0].members)
    )
    for c, column in enumerate(beside.columns):
        assert scale[c, column] == pytest.approx(TIMES[-1])
    assert np.count_nonzero(scale) == 3


def test_a_walk_ends_where_its_cosines_do() -> None:
    """At the end cosine k is (-1)^k."""
    d = given([WeightedExplanation((member("random_walk"),), 1.0)])
    ((_, group),) = d.explanations[0].members
    channel = group.params[0]
    ends = d.end_values.bias[channel, group.columns]
    own = ends[ends != 0.0]
    assert own[:4] == pytest.approx([-1.0, 1.0, -1.0, 1.0])


def test_the_drift_is_found_and_the_bias_is_right_at_the_end() -> None:
    found = fitted([WeightedExplanation((member("bias_drift", (0,)),), 1.0)])
    value = dict(zip(found.names, found.values, strict=True))
    sigma = dict(zip(found.names, np.sqrt(np.diag(found.covariance)), strict=True))
    assert value["acc_bias.x"] == pytest.approx(
        BIAS[0] + DRIFT * TIMES[-1], abs=0.3 * sigma["acc_bias.x"]
    )
    assert value["acc_scale.x"] == pytest.approx(
        SCALE[0], abs=0.3 * sigma["acc_scale.x"]
    )
    # the end of a line is known half as well as its middle
    assert sigma["acc_bias.x"] > 1.5 * 1e-3 / np.sqrt(len(PLACES))


def test_the_answer_is_the_mean_over_explanations() -> None:
    """Equation (1) of the module, of each explanation alone."""
    drift = member("bias_drift")
    one, none = fitted([WeightedExplanation((drift,), 1.0)], 3), fitted((), 3)
    both = fitted([WeightedExplanation((drift,), 0.7), WeightedExplanation((), 0.3)], 3)
    assert one.names == none.names == both.names
    mean = 0.7 * one.values + 0.3 * none.values
    # a less likely explanation is that of fewer of its variants
    sigma = np.sqrt(np.diag(both.covariance))
    np.testing.assert_allclose(both.values / sigma, mean / sigma, rtol=0, atol=0.02)
    spread = np.zeros_like(both.covariance)
    for share, each in ((0.7, one), (0.3, none)):
        off = each.values - mean
        spread += share * (each.covariance + np.outer(off, off))
    np.testing.assert_allclose(np.diag(both.covariance), np.diag(spread), rtol=0.02)
    assert both.causes == {"bias_drift": pytest.approx(0.7)}
    assert both.any_cause_probability == pytest.approx(0.7)


def test_a_cause_is_on_every_axis_that_it_may_be_on() -> None:
    """The one that shows it beyond doubt is in nearly all of them."""
    recorded = recording(1e-4)
    shown = [WeightedExplanation((member("bias_drift", (0,)),), 1.0)]
    d = ParameterSet(
        recorded.rows,
        np.ones(6),
        recorded.since_turn,
        False,
        ParameterSetOptions(),
        shown,
    )
    gram = GaussNewton(WindowSystem(recorded.rows, d), NOMINAL).gram(
        NOMINAL, np.zeros(d.width), None
    )
    found = variants(Sets(d, gram), d.base_members, d.explanations[0])
    assert sum(s.probability for s in found) == pytest.approx(1.0)
    sets = {s.members[0][1].params: s.probability for s in found}
    assert sum(p for axes, p in sets.items() if 0 in axes) > 0.99
    assert max(sets, key=lambda axes: sets[axes]) == (0,) and len(sets) > 1


def test_points_stand_evenly_for_the_variants_of_every_cause() -> None:
    """Of each cause by itself, and of two together."""
    for count in (1, 2, 3):
        at = spread_points(count)
        assert ((at >= 0) & (at < 1)).all()
        for column in at.T:
            inside = np.histogram(column, 6, (0.0, 1.0))[0] / len(at)
            assert np.abs(inside - 1 / 6).max() <= 0.5 / 6
    one, two = spread_points(2).T > 0.5
    for quarter in (one & two, one & ~two, ~one & two, ~one & ~two):
        assert 4 <= quarter.sum() <= 8
    assert len(spread_points(0)) == 1
    line = spread_points(1, 5)[:, 0]
    np.testing.assert_allclose(line, [0.1, 0.3, 0.5, 0.7, 0.9])
    two = spread_points(3, 4)
    np.testing.assert_allclose(two[:, 1], (np.arange(4) * 2**0.5 + 0.125) % 1)
    np.testing.assert_allclose(two[:, 2], (np.arange(4) * 3**0.5 + 0.125) % 1)


def test_cross_coupling_is_carried_in_the_axes_of_the_set() -> None:
    """Where no orientation is known: k21, k31 and k32 are a turn of the device."""
    rows = recording().rows
    nowhere = np.full(len(rows.x), np.nan)
    unknown = replace(rows.x, alpha=nowhere, beta=nowhere)
    cause, group = next(
        (c, c.variants[0]) for c in effect_causes(given()) if c.name == "cross_coupling"
    )
    carried = {}
    for x in (rows.x, unknown):
        d = ParameterSet(
            replace(rows, x=x), np.ones(6), recording().since_turn, False,
            ParameterSetOptions(),
            [WeightedExplanation(((cause, group),), 1.0)],
        )  # fmt: skip
        ((_, one),) = d.explanations[0].members
        assert one.effect is not None
        carried[bool(x.oriented.all())] = [
            one.effect.params[j].name for j in one.params
        ]
    assert carried[False] == ["k12", "k13", "k23"]
    assert carried[True] == ["k12", "k13", "k21", "k23", "k31", "k32"]
