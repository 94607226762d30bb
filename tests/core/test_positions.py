"""Positions, their forces by vectors turned one by one, and the sets as published."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core import positions
from fieldcal.core.positions import (
    FIVE_POSITIONS,
    POSITION_SETS,
    SIX_FACES,
    TWO_POSITIONS,
    WIDE_POSITIONS,
    Position,
    alpha_beta_angles,
    attitude_sigmas,
    gamma_angles,
    ladder_settings,
    specific_forces,
    table_rates,
    unknown_axis_speeds,
)

UNKNOWN = Position("as it lies")


def test_a_position_in_degrees_is_told_in_degrees() -> None:
    position = Position.deg(22.5, -5)
    assert position.name == "α = 22.5°, β = -5°"
    assert position.alpha == pytest.approx(np.pi / 8)
    assert position.beta == pytest.approx(-np.pi / 36)
    assert position.degrees == (22.5, -5.0) and position.rate is None
    assert Position.deg(0, 90, "on its side").name == "on its side"


def test_degrees_come_back_without_the_dust_of_the_conversion() -> None:
    for alpha in np.arange(-180, 180, 0.1).round(1):
        assert Position.deg(alpha, -alpha / 4).degrees == (alpha, round(-alpha / 4, 9))


@pytest.mark.parametrize(
    "position", [UNKNOWN, Position("a", alpha=0.0), Position("b", beta=0.0)]
)
def test_a_position_is_oriented_by_both_angles(position: Position) -> None:
    assert not position.oriented and position.degrees is None
    assert Position("level", 0.0, 0.0).oriented
    assert Position("level", 0.0, 0.0).degrees == (0.0, 0.0)


def test_a_third_angle_is_part_of_name_and_of_all_degrees() -> None:
    position = Position.deg(30, -5, gamma=12.5)
    assert position.name == "α = 30°, β = -5°, γ = 12.5°"
    assert position.gamma == pytest.approx(np.deg2rad(12.5))
    assert position.all_degrees == (30.0, -5.0, 12.5) and position.oriented
    # two angles do not tell how it lies
    assert position.degrees is None
    assert Position.deg(30, -5).all_degrees == (30.0, -5.0, 0.0)
    assert UNKNOWN.all_degrees is Position("a", beta=0.0).all_degrees is None
    assert Position("b", alpha=0.0).all_degrees is None


def test_all_degrees_of_a_tenth_come_back_and_no_zero_is_negative() -> None:
    for gamma in np.arange(-180, 180, 0.7).round(1):
        found = Position.deg(-0.0, gamma / 2, gamma=gamma).all_degrees
        assert found == (0.0, round(gamma / 2, 9), gamma)
        assert np.copysign(1.0, found[0]) == 1.0


def test_scaled_angles_are_all_multiplied_and_the_rest_is_kept() -> None:
    rate = (0.0, 0.5, 0.0)
    position = Position("on the table", 0.2, -0.1, rate, 0.3, 0.01, 2.0, 0.4)
    assert position.scaled(2.0) == Position(
        "on the table", 0.4, -0.2, rate, 0.6, 0.01, 2.0, 0.4
    )
    for unknown in (UNKNOWN, Position("a", alpha=0.3), Position("b", beta=0.3)):
        assert unknown.scaled(2.0) == unknown


@pytest.mark.parametrize(
    ("position", "turns"),
    [
        (UNKNOWN, False),
        (Position("still", rate=(0.0, 0.0, 0.0)), False),
        (Position("about z", rate=(0.0, 0.0, -0.5)), True),
        (Position("about an unknown axis", speed=0.5), True),
        (Position("about an unknown axis", speed=0.5, rate=(0.0, 0.0, 0.0)), True),
    ],
)
def test_a_table_turns_what_has_a_rate_or_a_speed(
    position: Position, turns: bool
) -> None:
    assert position.on_turning_table is turns


def test_speeds_about_an_unknown_axis_and_their_sigmas() -> None:
    seen = [Position("fast", speed=2.0, speed_sigma=0.01), UNKNOWN]
    speed, sigma = unknown_axis_speeds(seen)
    np.testing.assert_array_equal(speed, [2.0, 0.0])
    np.testing.assert_array_equal(sigma, [0.01, 0.0])
    whole = unknown_axis_speeds([Position("whole numbers", speed=2, speed_sigma=1)])
    assert [x.dtype for x in whole] == [float, float]


def test_sigmas_and_third_angles_of_positions() -> None:
    seen = [Position("held by hand", gamma=0.2, sigma=0.05), UNKNOWN]
    np.testing.assert_array_equal(attitude_sigmas(seen), [0.05, np.nan])
    np.testing.assert_array_equal(gamma_angles(seen), [0.2, 0.0])
    np.testing.assert_array_equal(attitude_sigmas([UNKNOWN]), [np.nan])
    assert gamma_angles([Position("whole numbers", gamma=1)]).dtype == float


def test_angles_and_rates_that_are_not_known() -> None:
    table = Position("turning", 0.1, 0.2, (0.0, 0.5, 0.0))
    alpha, beta = alpha_beta_angles([table, UNKNOWN])
    np.testing.assert_array_equal(alpha, [0.1, np.nan])
    np.testing.assert_array_equal(beta, [0.2, np.nan])
    np.testing.assert_array_equal(
        table_rates([table, UNKNOWN]), [[0, 0.5, 0], [0, 0, 0]]
    )


def test_no_position_has_no_angles_and_no_rates() -> None:
    assert alpha_beta_angles([])[0].shape == alpha_beta_angles([])[1].shape == (0,)
    assert table_rates([]).shape == specific_forces([], 9.81).shape == (0, 3)
    assert [x.shape for x in unknown_axis_speeds([])] == [(0,), (0,)]
    assert attitude_sigmas([]).shape == gamma_angles([]).shape == (0,)


def test_forces_are_gravity_seen_from_the_turned_device() -> None:
    found = specific_forces([*WIDE_POSITIONS, UNKNOWN], 9.79)
    for position, force in zip(WIDE_POSITIONS, found, strict=False):
        # a frame turned by +a sees vectors turned by -a
        assert position.degrees
        seen = Rotation.from_euler("z", -position.degrees[0], degrees=True).apply(
            [0, -9.79, 0]
        )
        seen = Rotation.from_euler("x", -position.degrees[1], degrees=True).apply(seen)
        np.testing.assert_allclose(force, seen, atol=1e-12)
    assert np.isnan(found[-1]).all()


def test_forces_are_those_after_a_third_turn_as_well() -> None:
    """About the y that both have turned: gravity goes from z to x."""
    gamma = np.pi / 3
    turned = Position("on its edge", 0.2, 0.7, gamma=gamma)
    two, three = specific_forces([Position("before", 0.2, 0.7), turned], 9.8)
    expected = Rotation.from_euler("y", -gamma).apply(two)
    np.testing.assert_allclose(three, expected, atol=1e-12)


def test_a_ladder_goes_to_either_side_and_has_home() -> None:
    had = [Position.deg(20, 0), Position.deg(-20.0000001, 2.5), UNKNOWN]
    found, sides = ladder_settings(had), (-20.0, 0.0, 20.0)
    assert sorted(found) == [(a, b) for a in sides for b in (-2.5, 0.0, 2.5)]
    assert found[0] == (0.0, 0.0) and {a for a, _ in found[:3]} == {0.0}
    assert "-0.0" not in str(found)  # nobody sets a joint to that
    assert ladder_settings([UNKNOWN]) == [] == ladder_settings([])


def test_the_sets_are_those_of_the_paper_and_a_ladder() -> None:
    assert [p.degrees for p in TWO_POSITIONS] == [(0, 0), (45, 5)]
    assert [p.degrees for p in FIVE_POSITIONS] == [
        (0, 0), (22.5, 0), (22.5, 2.5), (45, 2.5), (45, 5)
    ]  # fmt: skip
    assert {p.degrees for p in WIDE_POSITIONS} == {
        (0, 0),
        (45, 5),
        (45, -5),
        (-45, 5),
        (-45, -5),
    }
    assert POSITION_SETS == {
        "two": TWO_POSITIONS,
        "five": FIVE_POSITIONS,
        "wide": WIDE_POSITIONS,
        "six_faces": SIX_FACES,
    }
    assert all(p.name for p in FIVE_POSITIONS)
    assert positions._set((0, 0), (45, 5)) == TWO_POSITIONS


def test_six_faces_are_each_axis_up_and_down() -> None:
    up = (specific_forces(SIX_FACES, 1.0).round(12) + 0.0).tolist()
    faces = [*np.eye(3).tolist(), *(-np.eye(3)).tolist()]
    assert sorted(up) == sorted((np.array(faces) + 0.0).tolist())
