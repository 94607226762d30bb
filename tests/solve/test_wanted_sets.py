"""Contents of the sets that are fitted, and which sizes of errors they take."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from observed import observe
from test_borrowed import lot
from test_choose import fitted, session
from test_result import observed

from fieldcal.core.factory import FactoryErrors
from fieldcal.core.positions import (
    FIVE_POSITIONS,
    TWO_POSITIONS,
    Position,
    specific_forces,
)
from fieldcal.solve import session_fit, solve
from fieldcal.solve.options import SolveOptions
from fieldcal.solve.parameter_set import ParameterSetOptions
from fieldcal.solve.session_fit import SessionFit

TABLE = Position("table", 0.0, 0.0, rate=(0.0, 0.0, 0.5))


COARSER = FactoryErrors(1e-2, 2e-4, 9e-5)
STATED = FactoryErrors(1e-3, 2e-5, 9e-6)
G = 9.81
MANY = tuple(Position.deg(a, b) for a in (-60, -20, 20, 60, 120) for b in (-60, 0, 45))


def by_grade(
    monkeypatch: pytest.MonkeyPatch, chances: dict[str, float], **options: Any
) -> tuple[Any, list[FactoryErrors]]:
    """Fit with the sizes of the coarser grade, which are as likely as `chances`."""
    asked: list[FactoryErrors] = []
    coarse, fine = fitted(0.0, bias=1.0), fitted(0.0, bias=3.0)

    class WithChances:
        def coarser_probabilities(self, stated: FactoryErrors) -> dict[str, float]:
            assert stated is STATED
            return chances

        names, values = coarse.names, coarse.values
        covariance_of = coarse.covariance_of

    first = WithChances()

    def estimated(recorded: Any, turning: Any, nominal: Any, wanted: Any,
                  averaged: bool) -> Any:  # fmt: skip
        assert averaged and turning is None
        asked.append(wanted.factory)
        return first if len(asked) == 1 else fine

    monkeypatch.setattr(session_fit, "estimate_parameters", estimated)
    found = session(factory=COARSER, **options)._fit("none")
    return ("coarse" if found is first else found), asked


def test_errors_that_are_as_small_as_stated_have_their_stated_size(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Both kinds are as stated with a probability of 0.9 times 0.6."""
    chances = {"cross_coupling": 0.1, "quadratic": 0.5, "g_sensitivity": 0.4}
    found, asked = by_grade(monkeypatch, chances, at_best=STATED)
    assert asked == [COARSER, FactoryErrors(1e-3, 2e-4, 9e-6)]
    assert found.values[0] == 3.0
    assert found.covariance[0, 0] == pytest.approx(1 + (1 - 0.9 * 0.6) * 2.0**2)


def test_errors_that_are_coarser_keep_the_size_of_the_coarser_grade(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, asked = by_grade(monkeypatch, {"quadratic": 0.5}, at_best=STATED)
    assert found == "coarse" and asked == [COARSER]
    found, asked = by_grade(monkeypatch, {"quadratic": 0.1})
    assert found == "coarse" and asked == [COARSER], "no other grade is stated"


def wanted(
    monkeypatch: pytest.MonkeyPatch,
    method: str = "joint",
    places: tuple[Position, ...] = FIVE_POSITIONS,
    turns: Any = None,
    asked: tuple[Any, ...] = ("none",),
    known: dict[str, Any] | None = None,
    **options: Any,
) -> ParameterSetOptions:
    """Contents of the set that a session fits."""
    one: Any = SessionFit(
        observed(places, **(known or {})), SolveOptions(**options), cast(Any, method),
        None,
    )  # fmt: skip
    one.turn_integrator = turns
    given: list[ParameterSetOptions] = []

    def estimated(recorded: Any, turning: Any, nominal: Any, content: Any,
                  averaged: bool) -> Any:  # fmt: skip
        assert recorded is one.recorded and nominal is one.nominal
        assert turning == (turns if averaged else None)
        given.append(content)

    monkeypatch.setattr(session_fit, "estimate_parameters", estimated)
    one._fit(*asked)
    assert given[0].earth == one.earth_sigma
    return given[0]


def test_what_is_said_of_the_session_is_in_the_set(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    prior, factory = lot(), FactoryErrors(1e-3)
    plain = wanted(monkeypatch)
    assert plain.tilt == "none" and plain.level_deg is None and plain.lot is None
    assert not (plain.cross or plain.gyro_cross or plain.gyr_scale or plain.turned)
    assert (plain.angles_deg, plain.beside_tilt_deg) == (0.0, 0.0)
    said = wanted(
        monkeypatch, asked=("base_tilt", 0.3), cross=True, angles_deg=0.05, lot=prior,
        factory=factory, tilt="base_tilt",
    )  # fmt: skip
    assert (said.tilt, said.level_deg, said.angles_deg) == ("base_tilt", 0.3, 0.05)
    assert said.cross and said.lot is prior and said.factory is factory
    assert wanted(monkeypatch, "least_squares").cross


@pytest.mark.parametrize(
    ("tilt", "level", "size"),
    [("auto", None, 0.7), ("auto", 0.3, 0.0), ("base_tilt", None, 0.0)],
)
def test_the_other_kind_of_tilt_is_possible_where_none_is_asked_for_or_stated(
    monkeypatch: pytest.MonkeyPatch, tilt: str, level: float | None, size: float
) -> None:
    found = wanted(monkeypatch, asked=("base_tilt", level), tilt=tilt,
                   beside_tilt_deg=0.7)  # fmt: skip
    assert found.beside_tilt_deg == size


@pytest.mark.parametrize(
    ("places", "known", "scale"),
    [
        (FIVE_POSITIONS, {"grade": "navigation", "latitude": 0.7}, True),
        (FIVE_POSITIONS[:1], {"grade": "navigation", "latitude": 0.7}, False),
        (FIVE_POSITIONS, {"grade": "navigation"}, False),
        (FIVE_POSITIONS, {"latitude": 0.7}, False),
    ],
)
def test_the_rate_of_the_earth_gives_scale_factors_of_gyroscopes_that_see_it(
    monkeypatch: pytest.MonkeyPatch,
    places: tuple[Position, ...],
    known: dict[str, Any],
    scale: bool,
) -> None:
    found = wanted(monkeypatch, places=places, known=known)
    assert found.gyr_scale is scale and not found.gyro_cross


def test_tables_and_turns_give_the_whole_matrix_of_gyroscopes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    table = wanted(monkeypatch, places=(*FIVE_POSITIONS, TABLE))
    assert table.gyr_scale and table.gyro_cross and not table.turned
    turned = wanted(monkeypatch, turns="turns")
    assert turned.gyr_scale and turned.gyro_cross and turned.turned
    # windows alone choose the tilt
    alone = wanted(monkeypatch, turns="turns", asked=("base_tilt", None, False))
    assert not (alone.gyr_scale or alone.gyro_cross or alone.turned)


@pytest.mark.parametrize(
    ("k2", "size"), [(0.0, STATED.quadratic), (3e-4, COARSER.quadratic)]
)
def test_many_positions_tell_how_straight_a_device_is(k2: float, size: float) -> None:
    force = specific_forces(MANY, G)
    seen = observe(MANY, force + k2 * force**2, sigma=1e-4)
    found = solve(seen, cross=True, factory=COARSER, at_best=STATED)
    assert found.info["quadratic_sigma"] == size
    value, sigma = found.vector("acc_scale")
    assert np.abs((value - 1) / sigma).max() < 3


def test_two_positions_tell_nothing_and_the_coarser_grade_stays() -> None:
    seen = observe(TWO_POSITIONS, specific_forces(TWO_POSITIONS, G), sigma=1e-4)
    found = solve(seen, factory=COARSER, at_best=STATED)
    assert found.info["quadratic_sigma"] == COARSER.quadratic
    alone = solve(seen, factory=COARSER)
    np.testing.assert_allclose(found.covariance, alone.covariance)
