"""A device that is not where it should be is noticed, and the slip is named."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.frames import direction_cosines, specific_force_at_rest
from fieldcal.core.positions import (
    FIVE_POSITIONS,
    POSITION_SETS,
    TWO_POSITIONS,
    Position,
    specific_forces,
)
from fieldcal.core.samples import Array
from fieldcal.run.position_check import AcceptedPosition, check_position

G = 9.81
BIAS = np.array([0.25, -0.15, 0.2])
SCALE = np.array([1.008, 0.992, 1.004])


def measured(alpha: float, beta: float, tilt: float = 0.0) -> Array:
    """What a raw device with bias and scale shows on a tilted base; degrees."""
    base = direction_cosines(np.deg2rad(tilt), np.deg2rad(-tilt)) @ [0, -G, 0]
    f: Array = direction_cosines(np.deg2rad(alpha), np.deg2rad(beta)) @ base
    return BIAS + SCALE * f


@pytest.mark.parametrize("name", POSITION_SETS)
@pytest.mark.parametrize("tilt", [-2.0, 0.0, 2.0])
def test_the_right_positions_are_accepted_from_a_raw_device_on_a_tilted_base(
    name: str, tilt: float
) -> None:
    held: AcceptedPosition | None = None
    for position in POSITION_SETS[name]:
        alpha, beta = position.degrees or (0, 0)
        f = measured(alpha, beta, tilt)
        arrival = check_position(position, f, G, held)
        assert arrival.ok, (position.name, arrival.problem)
        held = held or AcceptedPosition(position, f)


@pytest.mark.parametrize(
    ("alpha", "beta", "says"),
    [
        (-45, 5, "α is turned the wrong way"),
        (45, -5, "β is turned the wrong way"),
        (-45, -5, "both angles are turned the wrong way"),
        (5, 45, "α and β are exchanged"),
        (0, 0, "it has not been turned yet"),
        (225, 5, "upside down"),
        (38, 5, "turn it by +"),
        (45, 0, "β is not turned yet"),
    ],
)
def test_a_slip_is_named(alpha: float, beta: float, says: str) -> None:
    held = AcceptedPosition(TWO_POSITIONS[0], measured(0, 0))
    arrival = check_position(TWO_POSITIONS[1], measured(alpha, beta), G, held)
    assert not arrival.ok and says in arrival.problem


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_missing_axis_is_said_not_an_angle(axis: int) -> None:
    f = np.array([0.0, -9.81, 0.0])
    f[axis] = np.nan
    seen = check_position(Position.deg(0, 0), f, 9.81, None)
    assert not seen.ok and "gives no value" in seen.problem
    assert "nan" not in seen.problem


def test_a_step_of_two_and_a_half_degrees_is_told_from_none() -> None:
    held = AcceptedPosition(FIVE_POSITIONS[1], measured(22.5, 0))
    assert not check_position(FIVE_POSITIONS[2], measured(22.5, 0), G, held).ok
    assert check_position(FIVE_POSITIONS[2], measured(22.5, 2.5), G, held).ok
    assert not check_position(FIVE_POSITIONS[2], measured(22.5, -2.5), G, held).ok


def test_the_first_position_upside_down_or_in_a_wrong_unit() -> None:
    over = check_position(TWO_POSITIONS[0], measured(180, 0), G, None)
    assert not over.ok and "upside down" in over.problem
    in_g = check_position(TWO_POSITIONS[0], measured(0, 0) / G, G, None)
    assert not in_g.ok and "unit" in in_g.problem


def test_without_angles_only_the_norm_is_judged() -> None:
    anywhere = Position("as you like")
    assert check_position(anywhere, measured(77, 33), G, None).ok
    assert not check_position(anywhere, 2 * measured(77, 33), G, None).ok


@given(st.floats(-180, 180), st.floats(-90, 90))
def test_angles_shown_are_the_angles_held(alpha: float, beta: float) -> None:
    f = specific_force_at_rest(np.deg2rad(alpha), np.deg2rad(beta), G)
    seen = check_position(Position("x"), f, G, None)
    again = specific_force_at_rest(
        np.deg2rad(seen.alpha_deg), np.deg2rad(seen.beta_deg), G
    )
    np.testing.assert_allclose(again, f, atol=1e-6)


def test_a_position_with_a_third_angle_is_found_and_missed() -> None:
    wanted = Position.deg(20.0, 10.0, gamma=40.0)
    there = specific_forces([wanted], 9.81)[0]
    assert check_position(wanted, there, 9.81, None).ok
    away = specific_forces([Position.deg(20.0, 10.0)], 9.81)[0]
    found = check_position(wanted, away, 9.81, None)
    assert not found.ok and "asked for is α = 20°, β = 10°, γ = 40°" in found.problem
    assert found.problem.startswith("γ is not turned yet: the device is at")
    other = specific_forces([Position.deg(26.0, 10.0, gamma=40.0)], 9.81)[0]
    found = check_position(wanted, other, 9.81, AcceptedPosition(wanted, there))
    assert (found.alpha_deg, found.beta_deg) == pytest.approx((26.0, 10.0))
    assert "α = 26.0°, β = 10.0° if γ is 40°" in found.problem
    assert found.problem.endswith("turn it by -6.0° in α")
    held = AcceptedPosition(Position.deg(20.0, 10.0), away)
    assert "not been turned yet" in check_position(wanted, away, 9.81, held).problem
