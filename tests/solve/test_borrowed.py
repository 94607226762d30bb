"""What a unit borrows from its lot: against dense algebra, and odd units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from observed import BIAS, SCALE, observe, outputs
from scipy.stats import multivariate_normal

from fieldcal.calibration import Calibration
from fieldcal.calibration.lot_prior import LotPrior
from fieldcal.core.errors import InputError
from fieldcal.core.positions import TWO_POSITIONS, Position
from fieldcal.core.samples import Array
from fieldcal.solve import Observations, solve

EIGHT = tuple(
    Position.deg(a, b)
    for a, b in [(0, 0), (90, 0), (-90, 0), (180, 0), (0, 90), (0, -90), (45, 45),
                 (-45, 45)]
)  # fmt: skip
NAMES = tuple(f"acc_{g}.{x}" for g in ("bias", "scale") for x in "xyz")
MIDDLE = np.array([*BIAS, *SCALE])
WIDE = np.repeat([0.01, 1e-3], 3)
SURE = 1e-12
"""Chance that a unit is odd where none is to be."""


def lot(
    mean: Array = MIDDLE, together: float = 0.0, odd: float = 0.01,
    names: tuple[str, ...] = NAMES, wide: Array = WIDE,
) -> LotPrior:  # fmt: skip
    k = len(names)
    alike = (1 - together) * np.eye(k) + together
    return LotPrior(
        "lot=7", names, mean, alike * wide * wide[:, None], np.full(k, odd), 6.0,
        (40,) * k,
    )  # fmt: skip


def seen(seed: int = 1, places: tuple[Position, ...] = EIGHT) -> Observations:
    rng = np.random.default_rng(seed)
    acc = outputs(places) + 0.02 * rng.standard_normal((len(places), 3))
    return observe(places, acc, sigma=2e-2)


def product(alone: Calibration, known: LotPrior) -> tuple[Array, Array]:
    """Mean and covariance of two Gaussians together, in any order of names."""
    at = [alone.names.index(n) for n in known.names]
    design = np.eye(len(alone.names))[at]
    prior = np.linalg.inv(known.covariance)
    told = np.linalg.inv(alone.covariance)
    covariance = np.linalg.inv(told + design.T @ prior @ design)
    return (
        covariance @ (told @ alone.values + design.T @ prior @ known.mean),
        covariance,
    )


@pytest.mark.parametrize("together", [0.0, 0.7])
def test_a_lot_is_gaussian_information_on_its_parameters(together: float) -> None:
    known = lot(together=together, odd=SURE)
    alone = solve(seen(), tilt="none")
    found = solve(seen(), tilt="none", lot=known)
    mean, covariance = product(alone, known)
    np.testing.assert_allclose(found.values, mean, atol=0.02 * alone.sigma.min())
    np.testing.assert_allclose(found.sigma, np.sqrt(np.diag(covariance)), rtol=0.02)
    off = covariance / found.sigma / found.sigma[:, None]
    made = found.covariance / found.sigma / found.sigma[:, None]
    np.testing.assert_allclose(made, off, atol=0.02)


def test_a_tilt_that_the_lot_knows_nothing_of_is_known_better_with_it() -> None:
    few = EIGHT[:5]
    alone = solve(seen(places=few), tilt="base_tilt")
    found = solve(seen(places=few), tilt="base_tilt", lot=lot(odd=SURE))
    tilts = [n for n in found.names if n.startswith("base_tilt")]
    assert tilts and set(tilts) <= set(alone.names)
    assert all(found.uncertainty(n) < alone.uncertainty(n) for n in tilts)
    told = found.info["borrowed"]["parameters"]
    assert set(told) == set(NAMES)
    for name in NAMES:
        assert told[name]["own_value"] == alone.value(name)
        assert told[name]["own_sigma"] == alone.uncertainty(name)
        assert told[name]["sigma"] == found.uncertainty(name)


def test_what_two_positions_leave_open_is_as_the_lot_has_it() -> None:
    known = lot(odd=SURE)
    one = observe(TWO_POSITIONS[:1], outputs(TWO_POSITIONS[:1]), sigma=1e-3)
    found = solve(one, method="joint", tilt="none", lot=known)
    for name, sigma in zip(NAMES, WIDE, strict=True):
        assert found.uncertainty(name) <= 1.01 * sigma
    x, z = found.uncertainty("acc_scale.x"), found.uncertainty("acc_scale.z")
    assert x == pytest.approx(1e-3, rel=0.02) and z == pytest.approx(1e-3, rel=0.02)
    assert found.info["borrowed"]["parameters"]["acc_scale.x"]["own_sigma"] is None
    assert abs(found.value("acc_scale.x") - SCALE[0]) < 1e-4


def chance_of_odd(alone: Calibration, known: LotPrior) -> float:
    """By the density of the unit's own estimate under each hypothesis."""
    k, odd = (
        len(known.names),
        known.outlier_probability[0] / (1 - known.outlier_probability[0]),
    )
    wide = [known.covariance]
    for j in range(k):
        more = np.zeros((k, k))
        more[j, j] = 35 * known.covariance[j, j]
        wide.append(known.covariance + more)
    wide.append(36 * known.covariance)
    weight = np.array([1.0, *[odd] * (k + 1)])
    density = [
        multivariate_normal(known.mean, alone.covariance + p).pdf(alone.values)
        for p in wide
    ]
    share = weight * density
    return float(1 - share[0] / share.sum())


@pytest.mark.parametrize("off", [0.0, 0.03, 0.04, 0.05, 0.2])
def test_how_likely_a_unit_is_odd_is_the_evidence(off: float) -> None:
    known = lot(MIDDLE + off * (np.arange(6) == 0), together=0.3)
    alone = solve(seen(2), tilt="none")
    found = solve(seen(2), tilt="none", lot=known)
    truth = chance_of_odd(alone, known)
    assert found.info["borrowed"]["odd_probability"] == pytest.approx(
        truth, rel=0.15, abs=1e-4
    )


def test_an_odd_unit_has_nothing_from_its_lot_and_is_said_to_be() -> None:
    known = lot(MIDDLE + 0.2 * (np.arange(6) == 1))
    alone = solve(seen(), tilt="none")
    found = solve(seen(), tilt="none", lot=known)
    np.testing.assert_array_equal(found.values, alone.values)
    np.testing.assert_array_equal(found.covariance, alone.covariance)
    told = found.info["borrowed"]
    assert told["refused"] and told["odd_parameter"] == "acc_bias.y"
    (said,) = [w for w in found.warnings if "odd" in w]
    assert "acc_bias.y" in said and "lot=7" in said and "m/s²" in said


def test_a_unit_of_another_make_is_odd_though_no_parameter_is_by_itself() -> None:
    signs = np.array([1, -1, 1, -1, 1, -1])
    known = lot(MIDDLE + 3.3 * WIDE * signs)
    exact = replace(seen(), covariance=1e-6 * seen().covariance,
                    mean=observe(EIGHT, outputs(EIGHT)).mean)  # fmt: skip
    found = solve(exact, tilt="none", lot=known)
    assert found.info["borrowed"]["refused"]


def test_between_the_two_the_uncertainty_has_both() -> None:
    known = lot(MIDDLE + 0.034 * (np.arange(6) == 0))
    alone = solve(seen(), tilt="none")
    found = solve(seen(), tilt="none", lot=known)
    odd = found.info["borrowed"]["odd_probability"]
    assert 0.1 < odd < 0.5
    _, both = product(alone, known)
    x = found.names.index("acc_bias.x")
    assert found.sigma[x] > 1.15 * np.sqrt(both[x, x])
    assert "may be odd" in " ".join(found.warnings)


def test_printed_formulas_know_of_no_lot() -> None:
    with pytest.raises(InputError, match="printed"):
        solve(seen(), as_printed=True, lot=lot())


def test_a_lot_of_other_parameters_changes_nothing() -> None:
    other = lot(np.zeros(1), names=("gyr_bias.x",), wide=np.ones(1))
    found, alone = (solve(seen(), tilt="none", lot=one) for one in (other, None))
    np.testing.assert_array_equal(found.values, alone.values)
    assert "borrowed" not in found.info
