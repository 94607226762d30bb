"""Which method suits the positions, and options that contradict each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from observed import observe
from test_borrowed import lot

from fieldcal.core.errors import InputError, NotObservable
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS, Position
from fieldcal.solve.observations import Observations
from fieldcal.solve.options import SolveOptions

HAND = Position("by hand")
TABLE = Position("on the table", rate=(0.0, 0.5, 0.0))


def seen(*positions: Position) -> Observations:
    return observe(positions, np.tile([0.0, -9.8, 0.0], (len(positions), 1)))


@pytest.mark.parametrize(
    ("positions", "method"),
    [
        (TWO_POSITIONS[:1], "joint"),
        (TWO_POSITIONS, "two_position"),
        (FIVE_POSITIONS, "joint"),
        ((HAND,), "scalar"),
        ((HAND,) * 9, "scalar"),
        ((*TWO_POSITIONS, HAND), "scalar"),
        ((*FIVE_POSITIONS[:3], HAND), "joint"),
        ((*TWO_POSITIONS, TABLE), "two_position"),
        ((TABLE, TABLE), "least_squares"),
    ],
)
def test_the_method_that_suits_the_positions(
    positions: tuple[Position, ...], method: str
) -> None:
    assert SolveOptions().method_for(seen(*positions)) == method


@pytest.mark.parametrize("method", ["two_position", "joint", "scalar"])
def test_a_method_that_is_asked_for_is_taken(method: Any) -> None:
    assert SolveOptions(method).method_for(seen(*TWO_POSITIONS)) == method


@pytest.mark.parametrize(
    ("positions", "options", "why"),
    [
        (FIVE_POSITIONS, {"method": "two_position"},
         "two positions with known angles are needed and no other, not 5 of 5: with"
         " more of them use the joint estimate"),
        ((*TWO_POSITIONS, HAND), {"method": "two_position"},
         "two positions with known angles are needed and no other, not 2 of 3: with"
         " more of them use the joint estimate"),
        ((*FIVE_POSITIONS, HAND), {"method": "joint"},
         "the method joint needs the angles of every position: the scalar method does"
         " without"),
        (TWO_POSITIONS, {"method": "two_position", "tilt": "base_tilt"},
         "two positions give bias and scale factor only, not tilt or cross-coupling:"
         " take five positions, each with another α or β"),
        (TWO_POSITIONS, {"method": "two_position", "cross": True},
         "two positions give bias and scale factor only, not tilt or cross-coupling:"
         " take five positions, each with another α or β"),
    ],
)  # fmt: skip
def test_positions_that_do_not_give_what_is_asked_for(
    positions: tuple[Position, ...], options: dict[str, Any], why: str
) -> None:
    with pytest.raises(NotObservable) as told:
        SolveOptions(**options).method_for(seen(*positions))
    assert str(told.value) == why


def test_the_five_position_method_does_not_go_without_the_tilt() -> None:
    with pytest.raises(InputError) as told:
        SolveOptions("five_position", "none").method_for(seen(*FIVE_POSITIONS))
    assert str(told.value) == ("the five-position method estimates the tilt: use joint")
    for tilt in ("auto", "angle_offset"):
        options = SolveOptions("five_position", tilt)
        assert options.method_for(seen(*FIVE_POSITIONS)) == "five_position"
    assert SolveOptions("joint", "none").method_for(seen(*TWO_POSITIONS)) == "joint"


@pytest.mark.parametrize(
    ("method", "tilt"), [("magic", "auto"), ("auto", "magic"), ("magic", "magic")]
)
def test_names_that_are_unknown_are_told_with_those_that_are_known(
    method: Any, tilt: Any
) -> None:
    with pytest.raises(InputError) as told:
        SolveOptions(method, tilt)
    assert str(told.value) == (
        f"method '{method}' with tilt '{tilt}' is unknown: methods are auto,"
        " two_position, five_position, least_squares, joint and scalar, tilts are auto,"
        " none, angle_offset and base_tilt"
    )


@pytest.mark.parametrize(
    "name", ["level_deg", "heading_deg", "angles_deg", "beside_tilt_deg"]
)
def test_an_angle_is_known_to_less_than_a_right_angle(name: str) -> None:
    for degrees in (-0.001, 90.0, 120.0):
        with pytest.raises(InputError) as told:
            SolveOptions(**{name: degrees})  # type: ignore[arg-type]
        assert str(told.value) == (
            f"an uncertainty of {degrees:g}° is none: give 0 to 90°"
        )
    for degrees in (0.0, 89.9):
        assert getattr(SolveOptions(**{name: degrees}), name) == degrees  # type: ignore[arg-type]


def test_printed_formulas_are_not_for_a_lot() -> None:
    with pytest.raises(InputError) as told:
        SolveOptions(as_printed=True, lot=lot())
    assert str(told.value) == "printed formulas know of no lot: leave one of them out"


def test_the_heading_in_radians() -> None:
    assert SolveOptions().heading is None
    assert SolveOptions(heading_deg=0.0).heading == 0.0
    assert SolveOptions(heading_deg=45.0).heading == pytest.approx(np.pi / 4)
