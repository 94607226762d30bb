"""Estimates of made-up numbers: two models in one covariance, causes, closures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from observed import observe, outputs

from fieldcal.core.factory import FactoryErrors
from fieldcal.core.positions import TWO_POSITIONS
from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.known_rows import KnownRows
from fieldcal.solve import estimation
from fieldcal.solve.estimation import ParameterEstimate
from fieldcal.solve.observation_rows import rows_of_observations

RNG = np.random.default_rng(5)


def estimate(
    names: Sequence[str], values: Array, covariance: Array, **known: Any
) -> ParameterEstimate:
    """An estimate of which only values and covariance are known."""
    nothing = cast(Any, None)
    one = ParameterEstimate(
        nothing, nothing, tuple(names), values, covariance, (), nothing, 0.0,
        np.zeros(len(names)), nothing, nothing, nothing, (),
    )  # fmt: skip
    return replace(one, **known)


def positive(n: int, size: float) -> Array:
    root = size * RNG.standard_normal((n, n + 2))
    return np.asarray(root @ root.T)


def test_another_model_adds_its_distance_and_its_larger_variance() -> None:
    one = estimate(["acc_bias.x"], np.array([0.3]), np.array([[0.04]]))
    for variance, more in ((0.09, 0.05), (0.01, 0.0)):
        other = estimate(["acc_bias.x"], np.array([0.5]), np.array([[variance]]))
        mixed = one.with_model_uncertainty(one, other, 0.25)
        assert mixed.covariance[0, 0] == pytest.approx(0.04 + 0.25 * (0.2**2 + more))
        assert mixed.values[0] == 0.3


def test_larger_covariances_are_reached_and_smaller_ones_change_nothing() -> None:
    names = ["acc_bias.x", "acc_scale.x", "gyr_bias.y"]
    ours, more, at = positive(3, 1.0), positive(3, 0.7), np.zeros(3)
    unit = np.diag([1.0, 1e-3, 1e-6])
    one = estimate(names, at, unit @ ours @ unit)
    larger = estimate(names, at, unit @ (ours + more) @ unit)
    mixed = one.with_model_uncertainty(one, larger, 1.0)
    np.testing.assert_allclose(mixed.covariance, larger.covariance, rtol=1e-9)
    back = larger.with_model_uncertainty(larger, one, 1.0)
    np.testing.assert_allclose(back.covariance, larger.covariance, rtol=1e-9)


def test_a_direction_that_is_worse_elsewhere_is_added_by_itself() -> None:
    """Sum and difference of two parameters are independent in both models."""
    turn = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2)
    ours, theirs = (turn @ np.diag(v) @ turn for v in ([1.0, 1.0], [3.0, 0.2]))
    one, other = (estimate(["a.x", "a.y"], np.zeros(2), c) for c in (ours, theirs))
    mixed = one.with_model_uncertainty(one, other, 0.5)
    expected = turn @ np.diag([2.0, 1.0]) @ turn
    np.testing.assert_allclose(mixed.covariance, expected, atol=1e-12)


def test_tilts_of_two_kinds_are_compared_by_their_axes() -> None:
    """alpha0 turns about z, beta0 about x; other parameters have no counterpart."""
    names = ["angle_offset.alpha0_deg", "acc_bias.x", "angle_offset.beta0_deg"]
    one = estimate(names, np.array([1.0, 0.1, 2.0]), np.eye(3))
    other = estimate(
        ["base_tilt.about_x_deg", "base_tilt.about_z_deg", "acc_bias.y"],
        np.array([2.5, 1.2, 0.0]), np.eye(3),
    )  # fmt: skip
    mixed = one.with_model_uncertainty(one, other, 1.0)
    apart = np.array([0.2, 0.0, 0.5])
    np.testing.assert_allclose(mixed.covariance, np.eye(3) + np.outer(apart, apart))
    again = other.with_model_uncertainty(other, one, 1.0)
    apart = np.array([-0.5, -0.2, 0.0])
    np.testing.assert_allclose(again.covariance, np.eye(3) + np.outer(apart, apart))


def test_the_difference_is_that_of_the_fits_to_the_same_rows() -> None:
    """A final fit may have more rows than the two that are compared."""
    final = estimate(["a.x", "a.y", "a.z"], np.full(3, 9.0), np.eye(3))
    one = estimate(["a.y", "a.x"], np.array([1.0, 2.0]), np.eye(2))
    other = estimate(["a.x", "a.y"], np.array([2.3, 1.1]), np.eye(2))
    mixed = final.with_model_uncertainty(one, other, 0.5)
    apart = np.array([0.3, 0.1, 0.0])
    expected = np.eye(3) + 0.5 * np.outer(apart, apart)
    np.testing.assert_allclose(mixed.covariance, expected, atol=1e-12)


def test_covariances_come_in_the_order_of_the_names() -> None:
    one = estimate(["a", "b", "c"], np.zeros(3), np.arange(9.0).reshape(3, 3))
    np.testing.assert_array_equal(one.covariance_of(["c", "a"]), [[8, 6], [2, 0]])


def cause(name: str, reportable: bool = True) -> Any:
    return SimpleNamespace(name=name, reportable=reportable), None


def test_causes_have_the_sum_of_their_explanations() -> None:
    explanations = [
        SimpleNamespace(probability=0.4, members=[cause("hum"), cause("hum")]),
        SimpleNamespace(probability=0.3, members=[cause("warm_up"), cause("hum")]),
        SimpleNamespace(probability=0.2, members=[cause("noise", False)]),
        SimpleNamespace(probability=0.1, members=[]),
    ]
    there: Any = SimpleNamespace(explanations=explanations)
    one = estimate([], np.zeros(0), np.zeros((0, 0)), parameter_set=there)
    assert list(one.causes.items()) == [("hum", 0.7), ("warm_up", 0.3)]
    assert one.any_cause_probability == pytest.approx(0.7)
    explanations[1].probability = 0.9
    explanations[1].members = [cause("warm_up")]
    assert list(one.causes) == ["warm_up", "hum"], "the likeliest comes first"


def test_what_the_factory_left_has_the_size_that_its_estimates_show() -> None:
    """The groups of the factory alone are weighed, by the rows of the whole set."""
    stated, coarser = FactoryErrors(quadratic=1e-5), FactoryErrors(quadratic=1e-4)
    group = Group("factory", "quadratic", np.array([3]), np.array([1e-4]),
                  fixed_size=1.0)  # fmt: skip
    other = Group("base_tilt", "quadratic", np.array([2]), np.array([1.0]))
    members = [(cast(Any, None), other), (cast(Any, None), group)]
    options = SimpleNamespace(factory=coarser)
    there: Any = SimpleNamespace(base_members=members, members="all", options=options)
    asked: list[Any] = []
    seen: list[Any] = []

    def evaluate(members: Any) -> Any:
        asked.append(members)
        return SimpleNamespace(state="state")

    def chances(state: Any, left: Any, *sizes: Any) -> dict[str, float]:
        seen.append((state, list(left), sizes))
        return {"quadratic": 0.25}

    one = estimate([], np.zeros(0), np.zeros((0, 0)), parameter_set=there,
                   sets=SimpleNamespace(evaluate=evaluate))  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(estimation, "chances_of_coarser", chances)
        assert one.coarser_probabilities(stated) == {"quadratic": 0.25}
    assert asked == ["all"]
    assert seen == [("state", [group], (coarser, stated))]


def test_bad_windows_are_in_the_order_of_the_positions() -> None:
    there: Any = SimpleNamespace(window_positions=np.array([0, 3, 1]))
    found: Any = SimpleNamespace(bad=np.array([0.1, 0.2, 0.3]))
    one = estimate([], np.zeros(0), np.zeros((0, 0)), parameter_set=there,
                   mixture=found)  # fmt: skip
    assert one.bad_probability.tolist() == [0.1, 0.3, 0.0, 0.2]


def test_closures_are_what_the_estimate_leaves_of_them() -> None:
    there: Any = SimpleNamespace(width=6)
    found: Any = SimpleNamespace(columns=np.array([4, 1]), mean=np.array([2.0, 0.5]))
    first: Any = SimpleNamespace(
        closure=np.array([3.0, 1.0]), columns=np.array([1, 4]),
        design=np.array([[2.0, 1.0], [0.0, 0.25]]), info=np.array([10.0, 4.0]),
    )  # fmt: skip
    second: Any = SimpleNamespace(
        closure=np.array([0.1]), columns=np.array([0]), design=np.array([[7.0]]),
        info=np.array([100.0]),
    )  # fmt: skip
    one = estimate([], np.zeros(0), np.zeros((0, 0)), parameter_set=there,
                   mixture=found, turn_rows=(first, second))  # fmt: skip
    # of the first 3 - 2 * 0.5 - 2 = 0 and 1 - 0.25 * 2 = 0.5, of the second 0.1
    assert one.closure_squares == pytest.approx((0.5**2 * 4 + 0.1**2 * 100, 3))
    assert replace(one, turn_rows=()).closure_squares == (0.0, 0)


def test_scatter_of_a_triad_is_the_root_of_its_mean_square() -> None:
    found: Any = SimpleNamespace(scatter=np.array([1.0, 2, 2, 6, 0, 0, 0.25]))
    assert estimation.window_scatter(found, (0, 1, 2)) == pytest.approx(3**0.5)
    assert estimation.window_scatter(found, (3, 4, 5)) == pytest.approx(12**0.5)
    assert estimation.closure_scatter(found) == 0.25


def test_means_have_no_turns() -> None:
    rows = rows_of_observations(observe(TWO_POSITIONS, outputs(TWO_POSITIONS)))
    assert rows.turn_integrator() is None


@pytest.mark.parametrize("legs", [(), ("from one position to the next",)])
def test_a_recording_without_a_turn_has_nothing_to_integrate(
    monkeypatch: pytest.MonkeyPatch, legs: tuple[str, ...]
) -> None:
    tracker = SimpleNamespace(legs=legs)
    monkeypatch.setattr(estimation, "TurnTracker", lambda *told: tracker)
    means = rows_of_observations(observe(TWO_POSITIONS, outputs(TWO_POSITIONS)))
    recorded = replace(means, source=cast(Any, "samples"))
    assert recorded.turn_integrator() is (cast(Any, tracker) if legs else None)


def test_what_is_known_before_of_lot_and_filters() -> None:
    recorded = rows_of_observations(observe(TWO_POSITIONS, outputs(TWO_POSITIONS)))
    nominal, nothing = cast(Any, None), SimpleNamespace(lot=None)
    columns = np.array([4, 7])
    there: Any = SimpleNamespace(options=nothing, filters=None)
    assert estimation._known_rows(there, recorded, nominal) is None
    seen = replace(recorded, filters=(np.array([[1.0, 2.0]]), np.array([3.0])))
    assert estimation._known_rows(there, seen, nominal) is None
    there.filters = SimpleNamespace(columns=columns)
    assert estimation._known_rows(there, recorded, nominal) is None
    none = replace(recorded, filters=(np.zeros((0, 2)), np.zeros(0)))
    assert estimation._known_rows(there, none, nominal) is None
    known = estimation._known_rows(there, seen, nominal)
    assert isinstance(known, KnownRows)
    np.testing.assert_array_equal(known.columns, columns)
    np.testing.assert_array_equal(known.design, [[1.0, 2.0]])
    np.testing.assert_array_equal(known.residual, [3.0])
