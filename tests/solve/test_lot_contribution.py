"""A unit beside its lot: densities of Gaussians, and what is told of it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from test_estimation import estimate

from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.core.samples import Array
from fieldcal.solve import lot_contribution
from fieldcal.solve.estimation import ParameterEstimate
from fieldcal.solve.lot_contribution import LotContribution, combine_with_lot

NAMES = ("acc_bias.x", "acc_bias.y", "acc_scale.x")
LOT_NAMES = ("acc_scale.x", "acc_bias.x")
ODD = np.array([0.02, 0.05])
FACTOR = 4.0
LOT = LotPrior(
    "lot=7", LOT_NAMES, np.array([1.001, 0.05]),
    np.array([[4e-6, 5e-6], [5e-6, 1e-4]]), ODD, FACTOR, (40, 38),
)  # fmt: skip
VALUES = np.array([0.08, -0.02, 1.004])
COVARIANCE = np.array([[4e-4, 1e-5, -6e-6], [1e-5, 9e-4, 0.0], [-6e-6, 0.0, 1e-6]])


def unit(values: Array = VALUES, covariance: Array = COVARIANCE) -> ParameterEstimate:
    """A unit by itself, all of whose parameters are determined."""
    there: Any = SimpleNamespace(names=NAMES)
    every: Any = SimpleNamespace(values=values, covariance=covariance)
    return replace(
        estimate(NAMES, values, covariance), parameter_set=there, all_parameters=every
    )


def hypotheses() -> list[tuple[str, float, Array]]:
    """Parameter, prior odds and covariance of the units, one after the other."""
    out = [("", 1.0, LOT.covariance)]
    for j, name in enumerate(LOT_NAMES):
        wide = LOT.covariance.copy()
        wide[j, j] *= FACTOR**2
        out.append((name, ODD[j] / (1 - ODD[j]), wide))
    both = ODD.mean()
    return [*out, ("", both / (1 - both), FACTOR**2 * LOT.covariance)]


def test_hypotheses_are_weighed_by_the_density_of_the_unit_by_itself() -> None:
    found = lot_contribution._OutlierHypotheses.of(unit(), LOT)
    design = np.zeros((2, 3))
    design[0, 2] = design[1, 0] = 1.0
    weight, told = [], np.linalg.inv(COVARIANCE)
    for h, (name, odds, wide) in enumerate(hypotheses()):
        assert found.parameters[h] == name
        spread = design @ COVARIANCE @ design.T + wide
        weight.append(odds * multivariate_normal(LOT.mean, spread).pdf(design @ VALUES))
        # as a product of two Gaussians
        prior = design.T @ np.linalg.inv(wide)
        covariance = np.linalg.inv(told + prior @ design)
        mean = covariance @ (told @ VALUES + prior @ LOT.mean)
        np.testing.assert_allclose(found.covariances[h], covariance, rtol=1e-9)
        np.testing.assert_allclose(found.means[h], mean, rtol=1e-9)
    share = np.array(weight) / sum(weight)
    np.testing.assert_allclose(found.probabilities, share, rtol=1e-9)
    assert found.outlier_probability == pytest.approx(1 - share[0])
    assert found.outlier_parameter == found.parameters[1 + int(share[1:].argmax())]


def test_the_mixture_has_the_moments_of_its_parts() -> None:
    found = lot_contribution._OutlierHypotheses.of(unit(), LOT)
    names = ("acc_scale.x", "base_tilt.about_x_deg", "acc_bias.y")
    ours = np.diag([1e-7, 0.01, 8e-4])
    with_lot = estimate(names, np.array([1.003, 0.4, -0.02]), ours)
    mixed = found.mixture_with(with_lot)
    at, there = [2, 1], [0, 2]
    mean = np.zeros(3)
    square = np.zeros((3, 3))
    for h, p in enumerate(found.probabilities):
        m, c = with_lot.values.copy(), ours.copy()
        if h:
            m[there] = found.means[h][at]
            c[np.ix_(there, there)] = found.covariances[h][np.ix_(at, at)]
        mean += p * m
        square += p * (c + np.outer(m, m))
    np.testing.assert_allclose(mixed.values, mean, rtol=1e-12)
    expected = square - np.outer(mean, mean)
    np.testing.assert_allclose(mixed.covariance, expected, rtol=1e-6, atol=1e-15)
    assert mixed.names == names


def test_a_unit_that_fits_is_mixed_and_an_odd_one_stays_alone() -> None:
    shift = np.array([0.0, 0.0, 0.5])
    for values, refused in ((VALUES, False), (VALUES + shift, True)):
        own = unit(values)
        with_lot = estimate(NAMES, values, 0.5 * COVARIANCE)
        kept, told = combine_with_lot(own, with_lot, LOT)
        assert told is not None and told.refused == refused
        assert told.lot.names == LOT_NAMES
        assert told.own["acc_bias.y"] == pytest.approx((values[1], 0.03))
        assert (kept is own) == refused
        sigma = np.sqrt(np.diag(kept.covariance))
        assert told.combined["acc_bias.x"] == (kept.values[0], sigma[0])
        assert told.outlier_parameter == "acc_scale.x" or not refused


def test_a_lot_that_has_nothing_in_common_contributes_nothing() -> None:
    own, other = unit(), estimate(("acc_bias.z",), np.zeros(1), np.eye(1))
    assert combine_with_lot(own, other, LOT) == (own, None)


def told(odd: float, parameter: str = "", **changed: Any) -> LotContribution:
    own = {"acc_bias.x": (0.08, 0.02), "acc_scale.x": (1.004, 1e-3)}
    combined = {"acc_bias.x": (0.06, 0.009), "acc_scale.x": (1.003, 9e-4)}
    whole = LotContribution(LOT, odd, parameter, own, combined)
    return replace(whole, **changed)


def test_what_the_lot_contributes_to_the_parameter_that_gains_most() -> None:
    assert told(0.1).sentence == (
        "what 38 units of lot=7 say is in this result: acc_bias.x has ± 0.02 by itself"
        " and ± 0.009 m/s² with it"
    )
    alone = told(0.0, own={"acc_bias.x": (0.08, 0.02)}).sentence
    assert alone.endswith("acc_scale.x has none by itself and ± 0.0009 with it")


def test_a_unit_that_may_be_odd_is_told_where() -> None:
    said = told(0.2, "acc_scale.x").sentence
    assert said.endswith(
        " and ± 0.009 m/s² with it; the unit may be odd, P = 0.20: acc_scale.x is"
        " 1.0040 ± 0.0010, where the lot has 1.0010 ± 0.0020, which is in the"
        " uncertainties"
    )


def test_an_odd_unit_is_told_with_what_to_do() -> None:
    assert told(0.97, "acc_bias.x").sentence == (
        "this unit is odd beside 38 units of lot=7 (P = 0.97): acc_bias.x is 0.080 ±"
        " 0.020 m/s², where the lot has 0.050 ± 0.010; nothing of the lot is in the"
        " result: see whether it is the right lot, and examine the unit"
    )
    # without a single one, that which is furthest off: the bias by 2.2 sigmas, not 1.3
    further = {"acc_bias.x": (0.0, 0.02), "acc_scale.x": (1.004, 1e-3)}
    assert "acc_bias.x is 0.000 ± 0.020 m/s²" in told(0.97, own=further).sentence
    unknown = told(0.97, own={}).sentence
    assert "(P = 0.97): in what several parameters are together; nothing" in unknown


def test_the_object_of_the_result() -> None:
    document = told(0.97, "acc_bias.x", own={"acc_bias.x": (0.08, 0.02)}).to_json()
    assert document == {
        "lot": "lot=7", "odd_probability": 0.97, "odd_parameter": "acc_bias.x",
        "refused": True,
        "parameters": {
            "acc_scale.x": {
                "units": 40, "lot_value": 1.001, "lot_sigma": pytest.approx(2e-3),
                "own_value": None, "own_sigma": None, "sigma": 9e-4,
            },
            "acc_bias.x": {
                "units": 38, "lot_value": 0.05, "lot_sigma": pytest.approx(0.01),
                "own_value": 0.08, "own_sigma": 0.02, "sigma": 0.009,
            },
        },
    }  # fmt: skip
    assert told(0.5, "acc_bias.x").to_json()["refused"] is False
    assert told(0.5, "acc_bias.x").to_json()["odd_parameter"] is None
    assert told(0.97, "").to_json()["odd_parameter"] is None
