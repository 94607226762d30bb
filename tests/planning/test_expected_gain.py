"""What a further position is expected to tell, against what it then does tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from fieldcal.core.positions import Position
from fieldcal.diagnosis.explain import Explanation, explain
from fieldcal.diagnosis.prepare import prepare_recording
from fieldcal.model.search.inference import Inference
from fieldcal.planning.expected_gain import ExpectedGain
from fieldcal.session import description_file
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.replay import simulate
from fieldcal.sim_device.vocabulary import checked_effect

LADDER = [Position.deg(a, b) for a in (-45, 0, 45) for b in (-5, 0, 5)]
ALLOWED = {"acc_bias.x": 0.02, "acc_bias.y": 0.02, "acc_bias.z": 0.02}
ALLOWED |= {"acc_scale.x": 2e-3, "acc_scale.y": 2e-3, "acc_scale.z": 2e-3}
SECONDS = 15.0
ANGLE = float(np.deg2rad(0.003))


PERFECT = {"squareness": 1e-9, "quadratic": 1e-9, "g_sensitivity": 1e-12}
"""A device in which the factory left next to nothing."""


def explained(
    positions: Sequence[Position],
    more: Sequence[tuple[str, dict[str, float]]] = (),
    left: Mapping[str, float] = PERFECT,
) -> Explanation:
    """Windows of a device on the ladder, explained."""
    starts = 5.0 + 25.0 * np.arange(len(positions))
    windows = [
        (p.alpha or 0.0, p.beta or 0.0, float(s), float(s) + SECONDS)
        for p, s in zip(positions, starts, strict=True)
    ]
    effects = tuple(checked_effect(name, given) for name, given in more)
    block = simulate(Profile(effects=effects), windows, seed=4)
    tables = []
    for p, w in zip(positions, windows, strict=True):
        alpha, beta = p.degrees or (0.0, 0.0)
        angles = {"alpha_deg": alpha, "beta_deg": beta}
        tables.append({**angles, "start_s": w[2], "end_s": w[3]})
    about = description_file.parse_description(
        {
            "site": {"latitude_deg": 45.0, "height_m": 0.0},
            "device": {"grade": "tactical", **left},
            "position": tables,
        }
    )
    return explain(prepare_recording(block, about))


def gain_of(found: Explanation) -> ExpectedGain:
    likely = found.posterior.weights_on_grid
    return ExpectedGain(found.rows, found.inferred, likely, ALLOWED, ANGLE)


def alone(gain: ExpectedGain) -> ExpectedGain:
    """The same where the likeliest explanation is certain."""
    out = copy(gain)
    best = max(out.explanations, key=lambda e: e.chance)
    out.explanations = [replace(best, chance=1.0)]
    return out


START = [Position.deg(0, 0), Position.deg(45, 5), Position.deg(-45, 5)]


@pytest.fixture(scope="module")
def started() -> Explanation:
    return explained(START)


@pytest.fixture(scope="module")
def three(started: Explanation) -> ExpectedGain:
    return gain_of(started)


def test_the_value_of_a_parameter_is_no_uncertainty(three: ExpectedGain) -> None:
    """Chances add up to one, also without the explanations that are too unlikely."""
    assert sum(e.chance for e in three.explanations) == pytest.approx(1.0)
    further, away = [Position.deg(22.5, 5)], copy(three)
    column = three.dictionary.bias
    away.explanations = [
        replace(e, state=replace(e.state, estimate=e.state.estimate
                                 + 7.0 * (e.state.columns == column)))
        for e in three.explanations
    ]  # fmt: skip
    told, same = three.of(further), away.of(further)
    np.testing.assert_allclose(same.variance, told.variance, rtol=1e-6)
    np.testing.assert_allclose(
        same.expected_variance, told.expected_variance, rtol=1e-6
    )


@pytest.fixture(scope="module")
def of_scales(started: Explanation) -> ExpectedGain:
    """The gain where the scale factors of the gyroscopes are wanted."""
    found = started
    likely = found.posterior.weights_on_grid
    allowed = {f"gyr_scale.{axis}": 1e-4 for axis in "xyz"}
    return ExpectedGain(found.rows, found.inferred, likely, allowed, ANGLE)


def test_the_turn_to_a_position_tells_scale_factors(of_scales: ExpectedGain) -> None:
    """A quarter of a turn by another way tells that of z, and no turn tells none."""
    told = of_scales.of([Position.deg(45, -5), Position.deg(-45, 5)])
    z = told.quantities.index("gyr_scale.z")
    there, here = told.expected_variance[:, z] / told.variance[z]
    assert there < 0.2 and here > 0.9
    assert told.gain[0] > 1.0 + told.gain[1]


def test_the_turn_to_a_position_begins_at_the_attitude_of_the_last(
    of_scales: ExpectedGain,
) -> None:
    """At a right angle of beta, gamma and alpha turn about one axis."""
    gain, gains = of_scales, []
    for alpha, gamma in ((70.0, 0.0), (40.0, 30.0), (90.0, -20.0), (70.0, 30.0)):
        x = gain.rows.x
        angles = {"alpha": alpha, "beta": 90.0, "gamma": gamma}
        last = {name: getattr(x, name).copy() for name in angles}
        for name, degrees in angles.items():
            last[name][-1] = np.deg2rad(degrees)
        one = copy(gain)
        one.rows = replace(gain.rows, x=replace(x, **last))
        gains.append(one.of([Position.deg(0, 5), Position.deg(45, -5)]).gain)
    np.testing.assert_allclose(gains[1:3], [gains[0], gains[0]], rtol=1e-9)
    assert (np.abs(gains[3] / gains[0] - 1) > 1e-3).any()


@pytest.mark.parametrize(
    "place",
    [
        (-45.0, -5.0),
        *(pytest.param((0.0, b), marks=pytest.mark.thorough) for b in (0.0, -5.0)),
    ],
)
def test_a_window_tells_what_was_expected_of_it(
    three: ExpectedGain, place: tuple[float, float]
) -> None:
    one = Position.deg(*place)
    before = alone(three).of([one])
    then = alone(gain_of(explained([*START, one]))).of([one])
    expected = np.sqrt(before.expected_variance[0, : len(ALLOWED)])
    came = np.sqrt(then.variance[: len(ALLOWED)])
    np.testing.assert_allclose(came, expected, rtol=0.35)


@pytest.mark.parametrize("left", [
    PERFECT,
    {"squareness": 2e-4, "quadratic": 2e-5, "g_sensitivity": 1e-12},
])  # fmt: skip
def test_what_is_expected_of_bias_and_scale_is_that_of_least_squares(
    left: Mapping[str, float], three: ExpectedGain
) -> None:
    """A dense fit, its derivatives by the forces themselves.

    Of what the factory left it is known how large it may be.
    """
    one = Position.deg(45, -5)
    if left is not PERFECT:
        three = gain_of(explained(START, left=left))
    told = alone(three).of([one]).expected_variance[0, : len(ALLOWED)]
    noise = three.rows.noise[:3] / np.sqrt(SECONDS * 100.0)
    weighed, places = list[np.ndarray](), [*START, one]
    for before, place in zip([None, *START], places, strict=True):
        rows, angle = _row(place), _by_angles(place) * ANGLE
        came = np.zeros(3) if before is None else _force(place) - _force(before)
        rows = np.column_stack([rows, np.diag(np.clip(came / 9.80665, -1, 1))])
        cov = np.diag(noise**2) + angle @ angle.T
        weighed.append(np.linalg.solve(np.linalg.cholesky(cov), rows))
    curves = left["quadratic"] * np.array([1.0, 9.80665, 1 / 98.0665])
    sizes = np.append(np.repeat(curves, 3), [5e-4] * 3)  # and what a turn leaves
    factory = 1 / np.append([left["squareness"]] * 6, sizes)
    whole = np.vstack([*weighed, np.hstack([np.zeros((18, 8)), np.diag(factory)])])
    limits = np.array(list(ALLOWED.values()))
    variance = np.diag(np.linalg.inv(whole.T @ whole))[:6].copy()
    variance[3:] += (3e-4 / 9.806) ** 2  # gravity is not known better
    np.testing.assert_allclose(told, variance / limits**2, rtol=0.3)


def _force(place: Position, tilt: Sequence[float] = (0.0, 0.0)) -> np.ndarray:
    """Force on a base that is turned by a little, m/s^2; small angles add."""
    a, b = (place.alpha or 0.0) + tilt[0], (place.beta or 0.0) + tilt[1]
    down = np.array([-np.sin(a), -np.cos(a), 0.0]) * 9.806
    return np.array([down[0], np.cos(b) * down[1], -np.sin(b) * down[1]])


def _row(place: Position) -> np.ndarray:
    """Derivatives by biases, scale factors, tilt, cross-coupling and curves, (3, 23).

    These are K2, a kink at zero and K3.
    """
    f, step = _force(place), 1e-5
    along_x = np.array([1.0, 0.0, 0.0])
    a, b = place.alpha or 0.0, place.beta or 0.0
    tilts = []
    for axis in (along_x, np.array([0.0, 0.0, 1.0])):
        base = np.array([0.0, -9.806, 0.0])
        off = np.cross(axis * step, base)
        x = np.cos(a) * off[0] + np.sin(a) * off[1]
        y = np.cos(a) * off[1] - np.sin(a) * off[0]
        turned = [x, np.cos(b) * y + np.sin(b) * off[2]]
        turned.append(np.cos(b) * off[2] - np.sin(b) * y)
        tilts.append(np.array(turned) / step)
    crossed = np.zeros((3, 6))
    for k, (i, j) in enumerate(permutations(range(3), 2)):
        crossed[i, k] = f[j]
    curves = [np.diag(f**2), np.diag(np.abs(f)), np.diag(f**3)]
    return np.column_stack([np.eye(3), np.diag(f), *tilts, crossed, *curves])


def _by_angles(place: Position) -> np.ndarray:
    step = 1e-6
    sides = [(step, 0.0), (0.0, step)]
    return np.column_stack([(_force(place, s) - _force(place)) / step for s in sides])


def test_the_position_that_is_worth_most_is_where_nothing_was_yet(
    three: ExpectedGain,
) -> None:
    worth = three.of(LADDER)
    best = LADDER[int(np.argmax(worth.gain))]
    assert (best.beta or 0.0) < 0, "no position has turned that joint back"
    assert worth.gain.min() >= 0
    again = [LADDER.index(p) for p in LADDER if p.degrees in {s.degrees for s in START}]
    assert worth.gain[again].max() < worth.gain.max() / 2


def test_a_cause_is_told_where_it_differs_from_what_stands_in_its_place() -> None:
    """A square and a difference between up and down are alike on one side."""
    start = [Position.deg(a, b) for a, b in ((0, 0), (45, 5), (22.5, -5), (35, 2))]
    gain = gain_of(explained(start, [("quadratic", {"x": 1e-3})]))
    sides = [Position.deg(40, 0), Position.deg(-40, 0)]
    worth = gain.of(sides)
    open_ = [i for i, n in enumerate(worth.quantities) if worth.variance[i] > 0.2]
    causes = [i for i in open_ if worth.quantities[i] not in ALLOWED]
    assert {"quadratic", "scale_asymmetry"} & {worth.quantities[i] for i in causes}
    same, other = worth.expected_variance[:, causes].sum(axis=1)
    assert other < 0.85 * same and worth.gain[1] > worth.gain[0]


@pytest.mark.thorough
def test_explanations_between_the_points_of_a_grid_count_at_the_points() -> None:
    """Columns that a refined shape has are in no dictionary of the search."""
    settling = {"gx": 3e-3, "gy": -2e-3, "gz": 2e-3, "tau_s": 3.0}
    found = explained(START[:2], [("settling", settling)])
    posterior = found.posterior
    causes = {c.key: c for c in found.dictionary.causes}
    other = causes["warm_up:gyr"]
    there = posterior.sets.evaluate(((other, other.variants[3]),))
    nearer = found.inferred.with_refined_shapes(there)
    likely = replace(nearer, score=found.best.set.score)
    posterior._nearer.append((there, likely))
    at_points = dict(posterior.weights_on_grid)
    assert sum(at_points.values()) == pytest.approx(1.0)
    assert at_points[there] >= dict(posterior.weights)[likely] > 0.2
    assert likely.state.columns.max() >= len(posterior.sets.gram.index)
    assert np.isfinite(gain_of(found).of(LADDER[:2]).gain).all()


@pytest.mark.thorough
def test_what_a_part_showed_may_be_contradicted_without_a_search_from_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tilt = [("base_tilt", {"about_x_deg": 0.5, "about_z_deg": -0.4})]
    other = [("settling", {"gx": 3e-3, "gy": -2e-3, "gz": 2e-3, "tau_s": 3.0})]
    before, whole = explained(START[:2], other), explained(START, tilt)
    assert {c.name for c, _ in before.best.set.members} == {"settling"}

    def refused(*_: object) -> None:
        raise AssertionError("searched from nothing")

    monkeypatch.setattr(Inference, "_search_from_nominal", refused)
    quick = explain(whole.prepared, before)
    assert [c.name for c, _ in quick.best.set.members] == ["base_tilt"]
    assert quick.best.set.keys == whole.best.set.keys


@pytest.mark.thorough
@pytest.mark.parametrize("name, given", [
    ("quadratic", {"x": 1e-3}),
    ("settling", {"gx": 3e-3, "gy": -2e-3, "gz": 2e-3, "tau_s": 3.0}),
])  # fmt: skip
def test_a_search_that_begins_with_what_was_found_before_finds_the_same(
    name: str, given: dict[str, float]
) -> None:
    places = [*START, Position.deg(-40, 0)]
    before, whole = (explained(places[:n], [(name, given)]) for n in (3, 4))
    quick = explain(whole.prepared, before)
    assert [c.key for c, _ in quick.best.set.members] == [
        c.key for c, _ in whole.best.set.members
    ]
    # what was found before, it tries as well to do without
    most = 1.25 * len(whole.inferred.search.sets.visited)
    assert len(quick.inferred.search.sets.visited) < most
    worth, full = (gain_of(one).of(LADDER) for one in (quick, whole))
    # a set as likely as 0.02 may be looked at by one of them alone
    np.testing.assert_allclose(worth.gain, full.gain, rtol=0.05, atol=0.06)
