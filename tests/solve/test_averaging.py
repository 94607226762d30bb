"""Which parameters count as determined, and their derivatives by columns."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.solve import averaging
from fieldcal.solve.averaging import (
    AllParameters,
    lot_rows,
    parameter_matrix,
    select_determined,
)
from fieldcal.solve.end_values import EndValues

NAMES = ("acc_bias.x", "gyr_scale.z", "base_tilt.about_x_deg")
AT = {"acc_bias.x": 2, "gyr_scale.z": 4, "base_tilt.about_x_deg": 1}
WIDTH = 6


def made_set(turned: bool = False, prior: float = 10.0) -> Any:
    """A set of three parameters in six columns, whose bias drifts with column 5."""
    bias, slopes = np.zeros((6, WIDTH)), np.zeros((6, 6, WIDTH))
    bias[0, 5], slopes[5, 5, 5], slopes[0, 0, 5] = 7.0, 0.5, 99.0
    slopes[5, 3, 3], slopes[5, 1, 3], slopes[3, 5, 3] = 0.2, 8.0, 9.0

    wide = np.full(WIDTH, prior)
    group = Group("bias", "acc", np.arange(WIDTH), wide, fixed_size=2.0)
    return SimpleNamespace(
        names=NAMES, column_by_name=AT, width=WIDTH, groups=[group],
        end_values=EndValues(bias, slopes, np.zeros(WIDTH, dtype=bool)),
        options=SimpleNamespace(turned=turned),
    )  # fmt: skip


def test_parameters_are_their_columns_and_what_drifts_until_the_end() -> None:
    columns = np.array([5, 4, 2, 1, 0])
    np.testing.assert_array_equal(
        parameter_matrix(made_set(), columns),
        [[7.0, 0, 1, 0, 0], [0.5, 1, 0, 0, 0], [0, 0, 0, 1, 0]],
    )


def test_a_scale_factor_may_be_along_another_axis_than_the_fixtures() -> None:
    """A gyroscope sees 0.2 times 0.3 of the rate about x; forces do not count."""
    mixture: Any = SimpleNamespace(
        columns=np.array([3, 4]), mean=np.array([0.3, 1.0]), covariance=np.eye(2)
    )
    more = averaging._askew_variance(made_set(), mixture)
    along = np.linalg.norm([1.0, 0.2 * 0.3])
    assert np.sqrt(more[1]) == pytest.approx(along - 1.0, rel=1e-3)
    assert more[[0, 2]].tolist() == [0.0, 0.0]


def test_nominal_values_are_those_of_the_sensors() -> None:
    nominal: Any = SimpleNamespace(bias=10.0 + np.arange(6), scale=20.0 + np.arange(6))
    found = averaging._nominal_values(made_set(), nominal)
    np.testing.assert_array_equal(found, [10.0, 25.0, 0.0])


def test_a_lot_is_rows_for_the_columns_of_its_parameters() -> None:
    nominal: Any = SimpleNamespace(bias=np.full(6, 0.5), scale=np.ones(6))
    names = ("gyr_scale.z", "gyr_bias.y", "acc_bias.x")
    covariance = np.array([[4.0, 0.0, 1.0], [0.0, 9.0, 0.0], [1.0, 0.0, 2.0]])
    lot = LotPrior("lot=7", names, np.array([1.1, 0.3, 0.7]), covariance,
                   np.full(3, 0.01), 6.0, (5,) * 3)  # fmt: skip
    known = lot_rows(made_set(), lot, nominal)
    assert known is not None
    # u^T C^-1 u of what the columns are off by, for any values of the columns
    u = np.random.default_rng(1).standard_normal(WIDTH)
    off = np.array([0.1 - u[4] - 0.5 * u[5], 0.2 - u[2] - 7 * u[5]])
    white = known.residual - known.design @ u[known.columns]
    kept = covariance[np.ix_([0, 2], [0, 2])]
    assert white @ white == pytest.approx(off @ np.linalg.solve(kept, off))
    assert lot_rows(made_set(), lot.subset(["gyr_bias.y"]), nominal) is None


def sigmas(*sigma: float) -> AllParameters:
    return AllParameters(
        np.array([0.1, 1.2, 3.0]), np.diag(np.square(sigma)), np.array([1.0, 2.0, 3.0])
    )


def test_what_rows_determine_is_kept_in_order_with_all_that_belongs_to_it() -> None:
    every = sigmas(0.5, 0.2, 1.0)
    names, values, covariance, moved, missing = select_determined(made_set(), every)
    assert names == ("acc_bias.x", "base_tilt.about_x_deg")
    assert missing == ("gyr_scale.z",), "a tenth is worse than a guess"
    np.testing.assert_array_equal(values, [0.1, 3.0])
    np.testing.assert_array_equal(covariance, np.diag([0.25, 1.0]))
    np.testing.assert_array_equal(moved, [1.0, 3.0])


@pytest.mark.parametrize(("turned", "limit"), [(False, 0.1), (True, 0.01)])
def test_gyroscopes_that_are_turned_are_to_be_known_better(
    turned: bool, limit: float
) -> None:
    for sigma, known in ((0.99 * limit, True), (1.01 * limit, False)):
        names = select_determined(made_set(turned), sigmas(0.5, sigma, 1.0))[0]
        assert ("gyr_scale.z" in names) == known


def test_a_variance_that_rows_hardly_reduce_is_not_determined() -> None:
    """The prior is of size 2 times 0.1."""
    limit = 0.2 * np.sqrt(thresholds.DETERMINED)
    for sigma, known in ((0.99 * limit, True), (1.01 * limit, False)):
        there = made_set(prior=0.1)
        names = select_determined(there, sigmas(sigma, 1e-3, 1e-3))[0]
        assert ("acc_bias.x" in names) == known
    free = made_set(prior=0.1)
    free.groups[0] = replace(free.groups[0], fixed_size=None)
    limit /= 2
    for sigma, known in ((0.99 * limit, True), (1.01 * limit, False)):
        names = select_determined(free, sigmas(sigma, 1e-3, 1e-3))[0]
        assert ("acc_bias.x" in names) == known


def test_the_mean_over_explanations_has_their_differences_in_its_covariance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two explanations; of the second half goes to a variant of the first."""
    drift, bump = "drift", "bump"
    made = {(): (1.0, 4.0), (drift,): (3.0, 1.0), (bump,): (7.0, 2.0)}

    def explained(members: Any, p: float) -> Any:
        return SimpleNamespace(members=members, probability=p)

    def variants(search: Any, known: Any, one: Any) -> list[Any]:
        if one.members == (drift,):
            return [explained((drift,), 1.0)]
        return [explained((drift,), 0.5), explained((bump,), 0.5)]

    there: Any = SimpleNamespace(
        explanations=[explained((drift,), 0.6), explained((bump,), 0.4)],
        base_members=(), members=(drift,), with_causes=lambda members: members,
    )  # fmt: skip
    doubts = []

    def mixture(there: Any, search: Any, members: Any, doubt: bool) -> Any:
        doubts.append(doubt)
        return members

    def at_end(there: Any, found: Any, nominal: Any) -> tuple[Array, Array]:
        value, variance = made[found]
        return np.array([value]), np.array([[variance]])

    monkeypatch.setattr(averaging, "Sets", lambda there, gram: None)
    monkeypatch.setattr(averaging, "variants", variants)
    monkeypatch.setattr(averaging, "mixture_with_causes", mixture)
    monkeypatch.setattr(averaging, "_parameters_at_end", at_end)

    class Likeliest(tuple[str, ...]):
        bad = np.array([0.0, 0.02])

    likeliest: Any = Likeliest((drift,))
    nothing = cast(Any, None)
    found = averaging.average_explanations(there, nothing, likeliest, nothing, True)
    # 0.8 of the drift and 0.2 of the bump
    mean = 0.8 * 3.0 + 0.2 * 7.0
    square = 0.8 * (1.0 + 3.0**2) + 0.2 * (2.0 + 7.0**2)
    assert found.values[0] == pytest.approx(mean)
    assert found.covariance[0, 0] == pytest.approx(square - mean**2)
    assert found.shift_sigmas[0] == pytest.approx((mean - 1.0) / 2.0)
    assert doubts == [True, True], "one for the bump, one for none of them"
    doubts.clear()
    likeliest.bad = np.array([0.0, 0.009])
    averaging.average_explanations(there, nothing, likeliest, nothing, True)
    assert doubts == [False, False]
    only = averaging.average_explanations(there, nothing, likeliest, nothing, False)
    assert (only.values[0], only.covariance[0, 0]) == (3.0, 1.0)
    assert only.shift_sigmas.tolist() == [0.0]
