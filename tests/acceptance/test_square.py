"""What a decision says of cross-coupling that a result leaves out."""

from __future__ import annotations

from dataclasses import replace

import pytest
from observed import observe

from fieldcal.acceptance.square import relies_on_square_axes
from fieldcal.calibration import Calibration, limits
from fieldcal.core.positions import SIX_FACES, TWO, Position, forces
from fieldcal.solve import solve

TACTICAL = limits.read("tactical")
G = 9.81


def found(positions: tuple[Position, ...]) -> Calibration:
    return solve(observe(positions, forces(positions, G), sigma=1e-4))


def test_a_small_ladder_relies_on_axes_so_square_that_its_limit_holds() -> None:
    result = found(TWO)
    told = result.info["cross_coupling_left_out"]
    (check,) = relies_on_square_axes(result, TACTICAL)
    limit = TACTICAL.sigma(told["parameter"].split(".")[0])
    assert check.ok is None and limit is not None and told["times"] > 1
    assert check.value == pytest.approx(limit / told["moved_by_one"])
    assert f"square to ± {100 * limit / told['moved_by_one']:.2g} %" in check.says
    assert f"moves {told['parameter']} by {limit:.2g}" in check.says


def test_faces_up_and_down_rely_on_nothing() -> None:
    result = found(SIX_FACES)
    assert "cross_coupling_left_out" not in result.info
    assert relies_on_square_axes(result, TACTICAL) == []


def test_cross_coupling_that_is_estimated_is_not_left_out() -> None:
    nine = tuple(Position.deg(a, b) for a in (-45, 0, 45) for b in (-30, 0, 30))
    result = solve(observe(nine, forces(nine, G), sigma=1e-4), cross=True)
    assert relies_on_square_axes(result, TACTICAL) == []


def test_what_has_no_limit_is_not_held_against_one() -> None:
    result = found(TWO)
    told = result.info["cross_coupling_left_out"] | {"parameter": "base_tilt.about_x"}
    other = replace(result, info={**result.info, "cross_coupling_left_out": told})
    assert relies_on_square_axes(other, TACTICAL) == []
