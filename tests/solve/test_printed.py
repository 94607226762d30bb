"""The misprints, each against the printed line written out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from observed import GYR_BIAS, OMEGA, observe, outputs

from fieldcal.core.errors import InputError, NotObservable
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.solve import solve
from fieldcal.solve.printed import printed_earth_rate

LATITUDE = 0.8
PLACES = tuple(Position.deg(a, b) for a, b in [(0, 0), (30, 20), (0, 50), (70, 0)])
NOWHERE = np.full((len(PLACES), 3), np.nan)


def test_lines_40_and_41_as_they_stand() -> None:
    seen = observe(PLACES, NOWHERE, gyr=NOWHERE, latitude=LATITUDE)
    up, north = OMEGA * np.sin(LATITUDE), OMEGA * np.cos(LATITUDE)
    found = printed_earth_rate(seen)
    for row, (a, b) in zip(found, np.deg2rad([(0, 0), (30, 20), (0, 50), (70, 0)]),
                           strict=True):  # fmt: skip
        third = -up * np.sin(a) * np.sin(b) + north * np.cos(b)
        expected = [
            up * np.sin(a),
            up * np.cos(a) * np.cos(b) + north * np.sin(b),
            -up if a == b == 0 else third,
        ]
        np.testing.assert_allclose(row, expected, rtol=1e-6)


def test_gyroscopes_of_the_navigation_grade_are_fitted_axis_by_axis() -> None:
    known = observe(PLACES, NOWHERE, gyr=NOWHERE, latitude=LATITUDE)
    w = printed_earth_rate(known)
    scale = np.array([1.1, 0.9, 1.2])
    seen = observe(PLACES, NOWHERE, gyr=GYR_BIAS + scale * w, latitude=LATITUDE,
                   grade="navigation", sigma_gyr=1e-7)  # fmt: skip
    found = solve(seen, as_printed=True)
    assert found.method == "least_squares" and found.warnings == ()
    np.testing.assert_allclose(found.vector("gyr_bias")[0], GYR_BIAS, atol=1e-12)
    np.testing.assert_allclose(found.vector("gyr_scale")[0], scale, atol=1e-7)
    for axis in range(3):
        design = np.column_stack([np.ones(4), w[:, axis]])
        cov = np.linalg.inv(design.T @ design) * 1e-14
        assert found.sigma[axis] ** 2 == pytest.approx(cov[0, 0])
        assert found.sigma[3 + axis] ** 2 == pytest.approx(cov[1, 1])


def test_an_axis_that_sees_no_change_has_no_scale_factor() -> None:
    places = (Position.deg(0, 20), Position.deg(0, 50))
    nowhere = np.full((2, 3), np.nan)
    seen = observe(places, nowhere, gyr=np.zeros((2, 3)), latitude=LATITUDE,
                   grade="navigation")  # fmt: skip
    assert solve(seen, as_printed=True).names == (
        "gyr_bias.x", "gyr_bias.y", "gyr_bias.z", "gyr_scale.y", "gyr_scale.z",
    )  # fmt: skip


def test_the_mean_is_the_bias_of_tactical_gyroscopes() -> None:
    gyr = GYR_BIAS + 1e-4 * np.arange(12.0).reshape(4, 3)
    for known in ({}, {"latitude": LATITUDE}, {"grade": "navigation"}):
        seen = observe(PLACES, NOWHERE, gyr=gyr, sigma_gyr=2e-5, **known)
        found = solve(seen, as_printed=True)
        assert found.names == ("gyr_bias.x", "gyr_bias.y", "gyr_bias.z")
        np.testing.assert_allclose(found.values, gyr.mean(axis=0))
        np.testing.assert_allclose(found.sigma, 2e-5 / 2)
    alone = observe(TWO_POSITIONS[:1], NOWHERE[:1], gyr=gyr[:1], grade="navigation",
                    latitude=LATITUDE)  # fmt: skip
    np.testing.assert_allclose(solve(alone, as_printed=True).values, gyr[0])


def test_what_is_printed_says_so_and_keeps_both_triads_apart() -> None:
    gyr = np.tile(GYR_BIAS, (5, 1))
    five = solve(
        observe(FIVE_POSITIONS, outputs(FIVE_POSITIONS), gyr=gyr), as_printed=True
    )
    assert five.method == "five_position"
    assert five.warnings == (
        "as printed: (23) is inverted, (22), (30), (34) lose the sign",
    )
    acc = [not n.startswith("gyr") for n in five.names]
    assert not five.covariance[np.ix_(np.array(acc), ~np.array(acc))].any()
    assert five.units[-1] == "rad/s" and five.units[0] == "m/s^2"
    assert (five.chi2, five.dof) == (0.0, 0) and np.isnan(five.rms)
    two = solve(observe(TWO_POSITIONS, outputs(TWO_POSITIONS)), as_printed=True)
    assert two.method == "two_position"
    assert two.warnings == (
        "as printed: the sign of (5) makes the scale factor of z negative",
    )
    assert two.value("acc_scale.z") == pytest.approx(-1.006, abs=1e-6)
    asked = solve(
        observe(TWO_POSITIONS, outputs(TWO_POSITIONS)),
        as_printed=True,
        method="two_position",
    )
    assert asked.names == two.names


def test_the_method_that_is_asked_for_is_taken() -> None:
    with pytest.raises(NotObservable, match="two positions with known angles are need"):
        solve(
            observe(FIVE_POSITIONS, outputs(FIVE_POSITIONS)),
            as_printed=True,
            method="two_position",
        )
    with pytest.raises(NotObservable, match="separate bias, scale factor and tilt on"):
        solve(
            observe(TWO_POSITIONS, outputs(TWO_POSITIONS)),
            as_printed=True,
            method="five_position",
        )


def test_what_the_print_has_not_is_refused() -> None:
    with pytest.raises(InputError) as error:
        solve(
            observe(FIVE_POSITIONS, outputs(FIVE_POSITIONS)),
            as_printed=True,
            method="joint",
        )
    assert str(error.value) == (
        "the paper prints no joint method: as printed are two_position and"
        " five_position"
    )
    with pytest.raises(NotObservable) as nothing:
        solve(observe(PLACES, NOWHERE), as_printed=True)
    assert str(nothing.value) == "no sensor was measured; the print gives nothing"
    laid = (*FIVE_POSITIONS, Position("on its side", None, None))
    seen = np.vstack([outputs(FIVE_POSITIONS), [9.81, 0.0, 0.0]])
    leave = ": leave out --as-printed"
    for last, why in (
        (laid[-1], "known angles, and those of on its side are not stated"),
        (Position("askew", 0.1, 0.2, gamma=0.3), "two angles, and askew has three"),
        (Position("spun", speed=0.5), "known rates, and spun turns about an axis that"
         " nobody knows"),
    ):  # fmt: skip
        with pytest.raises(InputError) as error:
            solve(observe((*FIVE_POSITIONS, last), seen), as_printed=True)
        assert str(error.value) == f"the paper prints formulas for {why}{leave}"
