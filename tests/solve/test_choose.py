"""Which fits are made and weighed, of fits that are made up."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from observed import observe, outputs
from test_estimation import estimate
from test_result import observed

from fieldcal.core.positions import TWO_POSITIONS
from fieldcal.solve import choose
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.session_fit import SessionFit, determines_all

LEVEL = 0.3
OFFSET, BASE = "angle_offset", "base_tilt"


def session(method: str = "joint", **options: Any) -> Any:
    fit = SessionFit(observed(), SolveOptions(**options), cast(Any, method),
                             None)  # fmt: skip
    return cast(Any, fit)


@pytest.mark.parametrize(
    ("method", "options", "asked"),
    [
        ("scalar", {"level_deg": LEVEL}, ("none",)),
        ("least_squares", {"tilt": "base_tilt"}, ("none",)),
        ("joint", {"level_deg": LEVEL}, ("base_tilt", LEVEL)),
        ("joint", {"level_deg": LEVEL, "tilt": "none"}, ("base_tilt", LEVEL)),
        ("two_position", {"level_deg": LEVEL}, ("base_tilt", LEVEL)),
        ("two_position", {}, ("none",)),
        ("two_position", {"level_deg": 0.0}, ("none",)),
        ("joint", {"tilt": "none"}, ("none", None)),
        ("joint", {"tilt": OFFSET, "level_deg": LEVEL}, (OFFSET, LEVEL)),
        ("five_position", {"tilt": BASE}, (BASE, None)),
        ("joint", {}, "the best"),
        ("five_position", {}, "the best"),
    ],
)
def test_the_tilt_that_is_fitted(
    method: str, options: dict[str, Any], asked: Any
) -> None:
    one = session(method, **options)
    one._fit = lambda *told: told
    one._fit_best_tilt = lambda: ("the best", [])
    assert one.best_fit() == (asked, [])


def test_the_rate_of_the_earth_is_that_of_the_place_or_none() -> None:
    seen = observed(latitude=0.7)
    options = SolveOptions(heading_deg=1.0)
    earth = 7.292115e-5
    said, none = (
        SessionFit(seen, options, "joint", None, there) for there in (True, False)
    )
    unsure = earth * np.cos(0.7) * np.deg2rad(1.0)
    assert said.earth_sigma == pytest.approx((unsure, 0.0, 0.0))
    assert none.earth_sigma == (0.0, 0.0, 0.0)
    home = earth * np.array([0.0, -np.sin(0.7), np.cos(0.7)])
    for one, base in ((said, home), (none, np.zeros(3))):
        np.testing.assert_allclose(one.recorded.rows.x.base_rate, base)
        np.testing.assert_allclose(one.base_rate, base)


def fitted(score: float, **known: Any) -> Any:
    """An estimate of a bias by a fit with a model of the tilt."""
    known = {"acc": SimpleNamespace(dof=4, chi2=2.0)} | known
    return estimate(["acc_bias.x"], np.array([known.pop("bias", 0.0)]),
                    np.array([[1.0]]), score=score, **known)  # fmt: skip


def best_of(offset: Any, base: Any) -> tuple[Any, list[str]]:
    one = session()
    fits = {OFFSET: offset, BASE: base, "none": "level"}
    asked: list[tuple[str, bool]] = []

    def fit(tilt: str, level: Any = None, follow: bool = True) -> Any:
        asked.append((tilt, follow))
        return fits[tilt]

    one._fit = fit
    found, notes = one._fit_best_tilt()
    assert asked[:2] == [(OFFSET, False), (BASE, False)]
    return found, notes


@pytest.mark.parametrize("first", [True, False])
def test_tilts_that_cannot_be_told_apart_are_both_in_the_covariance(
    first: bool,
) -> None:
    fits = [fitted(-7.0, bias=2.0), fitted(-8.5, bias=5.0)]
    found, (note,) = best_of(*(fits if first else fits[::-1]))
    names = (OFFSET, BASE) if first else (BASE, OFFSET)
    assert note == (
        f"the tilt is taken as {names[0]}, but these positions cannot tell it from"
        f" {names[1]} (chi2 differs by 3.0): the uncertainties cover both; more"
        " positions with both angles turned would tell"
    )
    other = np.exp(-8.5) / (np.exp(-8.5) + np.exp(-7.0))
    assert found.values[0] == 2.0
    assert found.covariance[0, 0] == pytest.approx(1.0 + other * 3.0**2)


def test_a_tilt_that_fits_worse_is_told_by_how_much() -> None:
    found, (note,) = best_of(fitted(-30.0), fitted(-10.0))
    assert (
        note == "the tilt is taken as base_tilt: angle_offset fits worse, by 40 in chi2"
    )
    assert found.covariance[0, 0] == pytest.approx(1.0)
    _, (note,) = best_of(fitted(-3.0), fitted(0.0))
    assert "cannot tell it from" in note
    found, (note,) = best_of(fitted(0.0), fitted(0.0))
    assert "taken as angle_offset, but" in note, "equal ones are taken in their order"
    far, _ = best_of(fitted(0.0), fitted(-5000.0))
    assert far.covariance[0, 0] == pytest.approx(1.0)


def test_a_tilt_that_alone_is_determined_is_taken() -> None:
    open_ = fitted(0.0, undetermined=("base_tilt.about_x_deg",))
    good = fitted(-90.0)
    assert best_of(good, open_) == (good, ["the tilt is taken as angle_offset"])
    assert best_of(open_, good) == (good, ["the tilt is taken as base_tilt"])


def test_positions_that_do_not_show_the_tilt_take_the_base_for_level() -> None:
    open_ = fitted(0.0, undetermined=("base_tilt.about_x_deg",))
    found, (note,) = best_of(open_, open_)
    assert found == "level"
    assert note == "these positions do not show the tilt, so the base is taken as level"
    few = SessionFit(
        observe(TWO_POSITIONS, outputs(TWO_POSITIONS)), SolveOptions(), "joint", None
    )
    assert few._level_assumed_note().startswith(f"{note}; add α = ")
    assert few._level_assumed_note().endswith(" to find it")


def test_rows_beyond_those_of_the_windows_are_fitted_again() -> None:
    one = session()
    fits = {OFFSET: "by windows"}
    one._fit = lambda tilt: f"all rows, {tilt}"
    assert one._fit_all_rows(OFFSET, fits) == "by windows"
    one.turn_integrator = "turns"
    assert one._fit_all_rows(OFFSET, fits) == "all rows, angle_offset"
    one.turn_integrator, one.recorded = None, SimpleNamespace(explanations=("one",))
    assert one._fit_all_rows(OFFSET, fits) == "all rows, angle_offset"


@pytest.mark.parametrize(
    ("undetermined", "all_of_them"),
    [
        ((), True),
        (("acc_bias.x",), False),
        (("acc_scale.z",), False),
        (("angle_offset.alpha0_deg",), False),
        (("gyr_scale.z", "cross_coupling.k12"), True),
    ],
)
def test_what_a_tilt_has_to_leave_determined(
    undetermined: tuple[str, ...], all_of_them: bool
) -> None:
    assert determines_all(fitted(0.0, undetermined=undetermined)) == all_of_them


def test_without_any_means_nothing_is_determined() -> None:
    nothing = SimpleNamespace(dof=0, chi2=0.0)
    empty = estimate([], np.zeros(0), np.zeros((0, 0)), acc=cast(Any, nothing))
    assert not determines_all(empty)
    assert determines_all(fitted(0.0, acc=nothing))


def over_rates(
    monkeypatch: pytest.MonkeyPatch, gain: float | None, none: float
) -> tuple[Any, list[str], list[str]]:
    """Fits with the Earth's rate as stated, another (by `gain`) and none."""
    asked: list[str] = []
    fits = {"stated": fitted(40.0, bias=1.0), "none": fitted(none, bias=7.0)}
    rates = SimpleNamespace(
        stated=fitted(0.0, bias=1.0), another=fitted(0.0, bias=3.0), none=fits["none"]
    )

    class Session:
        nominal, base_rate = "nominal", "base rate"

        def __init__(self, *told: Any, earth: bool = True) -> None:
            self.earth = "stated" if earth else "none"

        def best_fit(self) -> Any:
            asked.append(self.earth)
            return fits[self.earth], [f"a note of {self.earth}"]

    def of(*told: Any) -> Any:
        assert told == (fits["stated"], "nominal", "base rate")
        asked.append("others")
        return rates

    shown = None
    if gain is not None:
        favoured = gain > np.log(1e-3)
        shown = SimpleNamespace(gain=gain, other_favoured=favoured)
    measured = SimpleNamespace(of=lambda *told: shown)
    monkeypatch.setattr(choose, "SessionFit", Session)
    monkeypatch.setattr(choose, "VerticalEarthRate", measured)
    monkeypatch.setattr(choose, "OtherEarthRates", SimpleNamespace(of=of))
    found, notes = choose._fit_over_earth_rates(
        observed(), SolveOptions(), "joint", None
    )
    return found, notes, asked


@pytest.mark.parametrize("gain", [None, -9.0])
def test_the_stated_latitude_is_enough_where_no_other_is_favoured(
    monkeypatch: pytest.MonkeyPatch, gain: float | None
) -> None:
    found, notes, asked = over_rates(monkeypatch, gain, 0.0)
    assert asked == ["stated"] and notes == ["a note of stated"]
    assert found.covariance[0, 0] == 1.0


@pytest.mark.parametrize(("gain", "none"), [(-1.0, 5.0), (1.0, 6.5), (2.0, -40.0)])
def test_other_rates_of_the_earth_are_in_the_covariance(
    monkeypatch: pytest.MonkeyPatch, gain: float, none: float
) -> None:
    """Odds of 1 for the stated one, e^gain for another, e^none / 1000 for none."""
    found, notes, asked = over_rates(monkeypatch, gain, none)
    assert asked == ["stated", "others"]
    odds = np.array([1.0, np.exp(gain), 1e-3 * np.exp(none)])
    weight = odds / odds.sum()
    assert found.values[0] == 1.0 and notes == ["a note of stated"]
    expected = 1.0 + weight[1] * (3.0 - 1.0) ** 2 + weight[2] * (7.0 - 1.0) ** 2
    assert found.covariance[0, 0] == pytest.approx(expected)


def test_no_rate_of_the_earth_is_taken_where_it_is_the_likeliest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, notes, asked = over_rates(monkeypatch, 1.0, 9.0)
    assert asked == ["stated", "others", "none"]
    odds = np.array([1.0, np.exp(1.0), 1e-3 * np.exp(9.0)])
    weight = odds / odds.sum()
    assert found.values[0] == 7.0
    assert notes == [choose.NO_EARTH, "a note of none"]
    expected = 1.0 + weight[0] * (1.0 - 7.0) ** 2 + weight[1] * (3.0 - 7.0) ** 2
    assert found.covariance[0, 0] == pytest.approx(expected)
