"""Filters of two recordings held against each other, and sets that may all be right."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fieldcal.against import calibrations
from fieldcal.against.causes import DecidedCauses
from fieldcal.against.filters import filter_difference
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.filtered_turns import FILTERED

GROUP = Group("device", FILTERED, np.array([7, 8, 9, 10]), np.array([1e-2] * 4))


def side(square: tuple[float, float], sigma: tuple[float, float]) -> Any:
    """A session whose turns show the variances of two impulse responses."""
    values, covariance = np.array(square), np.diag(np.square(sigma))

    def estimate(columns: Any) -> Any:
        assert columns.tolist() == [7, 8], "variances alone"
        return values, covariance

    dictionary = SimpleNamespace(filters=GROUP)
    return SimpleNamespace(
        estimate=estimate, fit=SimpleNamespace(dictionary=dictionary)
    )


def against(real: Any, sim: Any) -> Any:
    return list(
        filter_difference(cast(DecidedCauses, SimpleNamespace(real=real, sim=sim)))
    )


NONE, SOME, MORE = (1e-6, -2e-6), (2.5e-3, 9e-4), (4e-3, 9e-4)
SIGMA = (5e-5, 4e-5)


@pytest.mark.parametrize(
    ("real", "sim", "direction"),
    [(SOME, NONE, "left_out"), (NONE, SOME, "added"), (MORE, SOME, "resized")],
)
def test_a_filter_is_in_one_or_in_both(
    real: tuple[float, float], sim: tuple[float, float], direction: str
) -> None:
    (found,) = against(side(real, SIGMA), side(sim, SIGMA))
    assert (found.id, found.direction) == ("bandwidth", direction)
    assert found.probability > 0.99
    both = found.parameters["acc"]
    for told, square in ((both.real, real), (both.simulator, sim)):
        if square is NONE:
            assert told is None
        else:
            assert told.value == pytest.approx(square[0] ** 0.5)
            assert told.sigma == pytest.approx(SIGMA[0] / 2 / square[0] ** 0.5)


@pytest.mark.parametrize(("real", "sim"), [(SOME, SOME), (NONE, NONE)])
def test_filters_that_are_alike_are_no_difference(
    real: tuple[float, float], sim: tuple[float, float]
) -> None:
    assert not against(side(real, SIGMA), side(sim, SIGMA))
    vague = 40 * SIGMA[0], 40 * SIGMA[1]
    assert not against(side(SOME, vague), side(NONE, vague))


def test_without_turns_nothing_is_said() -> None:
    nothing = SimpleNamespace(filters=None)
    bare = SimpleNamespace(fit=SimpleNamespace(dictionary=nothing))
    assert not against(side(SOME, SIGMA), bare)


def test_sets_that_may_all_be_right_have_biases_apart() -> None:
    """Of two with 3 to 1, means 4 and 0 apart: 0.75 x 0.25 x 16."""

    def one(*estimate: float) -> Any:
        state = SimpleNamespace(
            columns=np.array([2, 3]), estimate=np.array(estimate), half=np.eye(2)
        )
        return SimpleNamespace(state=state, members=())

    sets = [(one(4.0, 1.0), 0.6), (one(0.0, 1.0), 0.2)]
    explanation = cast(Explanation, SimpleNamespace(
        dictionary=SimpleNamespace(bias=2, scale=8),
        model_average=SimpleNamespace(sets=sets)
    ))  # fmt: skip
    found = calibrations.scatter_between_sets(explanation, "acc_bias", np.array([0, 1]))
    np.testing.assert_allclose(found, [[3.0, 0.0], [0.0, 0.0]], atol=1e-12)
