"""Where a position says that the device was held, in each of its forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fieldcal.core.errors import InputError
from fieldcal.core.frames import direction_cosines
from fieldcal.core.positions import Position
from fieldcal.session.attitude import parse_attitude
from fieldcal.session.description_file import parse_description

ANGLE = st.floats(-400, 400)
UNIT = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(v * v for v in q) > 0.1)


def to_device(position: Position) -> np.ndarray:
    assert position.alpha is not None and position.beta is not None
    return direction_cosines(position.alpha, position.beta, position.gamma)


@given(ANGLE, ANGLE, ANGLE)
def test_three_angles_turn_about_z_the_turned_x_and_the_turned_y(
    alpha: float, beta: float, gamma: float
) -> None:
    table = {"alpha_deg": alpha, "beta_deg": beta, "gamma_deg": gamma}
    turned = Rotation.from_euler("ZXY", [alpha, beta, gamma], degrees=True)
    np.testing.assert_allclose(
        to_device(parse_attitude(1, table, "")), turned.as_matrix().T, atol=1e-9
    )


@given(UNIT)
def test_a_quaternion_is_one_turn_from_home(given_: tuple[float, ...]) -> None:
    w, x, y, z = np.array(given_) / np.linalg.norm(given_)
    found = parse_attitude(1, {"quaternion": [w, x, y, z]}, "")
    turned = Rotation.from_quat([x, y, z, w])
    np.testing.assert_allclose(to_device(found), turned.as_matrix().T, atol=1e-8)


@given(st.tuples(*[st.floats(-720, 720)] * 3))
def test_so_is_a_rotation_vector(vector: tuple[float, float, float]) -> None:
    found = parse_attitude(1, {"rotation_vector_deg": list(vector)}, "")
    turned = Rotation.from_rotvec(vector, degrees=True)
    np.testing.assert_allclose(to_device(found), turned.as_matrix().T, atol=1e-8)


@pytest.mark.parametrize("beta", [90.0, -90.0])
def test_where_two_axes_fall_together_the_third_angle_is_zero(beta: float) -> None:
    turned = Rotation.from_euler("ZXY", [30.0, beta, 50.0], degrees=True)
    x, y, z, w = turned.as_quat()
    found = parse_attitude(1, {"quaternion": [w, x, y, z]}, "")
    assert found.gamma == 0.0
    np.testing.assert_allclose(to_device(found), turned.as_matrix().T, atol=1e-9)


def test_what_two_angles_say_is_as_it_was() -> None:
    found = parse_attitude(1, {"alpha_deg": 45.0, "beta_deg": 5.0}, "")
    assert found == Position.deg(45.0, 5.0) and found.degrees == (45.0, 5.0)
    third = parse_attitude(
        1, {"alpha_deg": 45.0, "beta_deg": 5.0, "gamma_deg": 10.0}, ""
    )
    assert third.name == "α = 45°, β = 5°, γ = 10°" and third.degrees is None
    assert parse_attitude(3, {}, "") == Position("position 3")


def test_each_has_its_own_uncertainty() -> None:
    about = parse_description(
        {"position": [{"quaternion": [1, 0, 0, 0], "attitude_sigma_deg": 0.5}, {}]}
    )
    assert about.positions[0].sigma == pytest.approx(np.deg2rad(0.5))
    assert about.positions[0].name == "α = 0°, β = 0°"
    assert about.positions[1].sigma is None


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"alpha_deg": 1, "beta_deg": 1, "quaternion": [1, 0, 0, 0]}, "give one of"),
        ({"quaternion": [1, 0, 0, 0], "rotation_vector_deg": [0] * 3}, "give one of"),
        ({"quaternion": [0, 0, 0, 0]}, "quaternion has length 0:"),
        ({"quaternion": [1, 1, 0, 0]}, "quaternion has length 1.414:"),
        ({"quaternion": [1, 0, 0]}, "four numbers"),
        ({"quaternion": [float("nan")] * 4}, "number 1 quaternion"),
        ({"rotation_vector_deg": [1, 2]}, "three numbers"),
        ({"gamma_deg": 5}, "alpha_deg"),
        ({"attitude_sigma_deg": 1}, "no attitude"),
        ({"alpha_deg": 1, "beta_deg": 1, "attitude_sigma_deg": 0}, "more than 0"),
    ],
)
def test_what_is_no_attitude_is_refused(table: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=r"\[\[position\]\] number 1") as wrong:
        parse_description({"position": [table]})
    assert said in str(wrong.value)
