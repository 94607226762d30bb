"""Normal gravity against published values and the gradient of the normal potential."""

import doctest
import math

import numpy as np
import pytest

from fieldcal.core import gravity
from fieldcal.core.errors import InputError


@pytest.mark.parametrize(
    ("phi", "published"),
    [(0.0, 9.7803253359), (45.0, 9.8061977694), (90.0, 9.8321849379)],
)
def test_gravity_on_the_ellipsoid_is_as_published(phi: float, published: float) -> None:
    for latitude in (phi, -phi):
        assert gravity.normal_gravity(latitude) == pytest.approx(published, abs=2e-9)


def of_the_potential(latitude_deg: float, height: float) -> float:
    """Heiskanen and Moritz 1967, (2-62) and (2-66), in ellipsoidal coordinates."""
    gm, omega, a, f = 3.986004418e14, 7.292115e-5, 6378137.0, 1 / 298.257223563
    b = a * (1 - f)
    e = math.sqrt(a * a - b * b)
    s, c = math.sin(math.radians(latitude_deg)), math.cos(math.radians(latitude_deg))
    n = a / math.sqrt(1 - (e / a * s) ** 2)
    p, z = (n + height) * c, (n * (b / a) ** 2 + height) * s
    k = p * p + z * z - e * e
    u2 = k / 2 * (1 + math.sqrt(1 + 4 * (e * z / k) ** 2))
    u, v = math.sqrt(u2), math.sqrt(u2 + e * e)
    sin = z / u
    cos = math.sqrt(1 - sin * sin)
    w = math.sqrt((u2 + (e * sin) ** 2) / (u2 + e * e))

    def q(u: float) -> float:
        return ((1 + 3 * (u / e) ** 2) * math.atan(e / u) - 3 * u / e) / 2

    steep = 3 * (1 + (u / e) ** 2) * (1 - u / e * math.atan(e / u)) - 1
    down = gm / v**2 + (omega * a / v) ** 2 * e * steep / q(b) * (sin**2 / 2 - 1 / 6)
    down -= omega**2 * u * cos**2
    north = (omega**2 * v - (omega * a) ** 2 / v * q(u) / q(b)) * sin * cos
    return math.hypot(down, north) / w


@pytest.mark.parametrize("height", [-500.0, 0.0, 170.0, 4000.0, 9000.0])
def test_gravity_above_is_the_gradient_of_the_normal_potential(height: float) -> None:
    tolerance = 1.2e-10 * abs(height) + 1e-11  # of the terms that the series leaves out
    for latitude in np.linspace(-80, 90, 6):
        truth = of_the_potential(latitude, height)
        assert gravity.normal_gravity(latitude, height) == pytest.approx(
            truth, abs=tolerance
        )


def test_gravity_falls_with_height_by_the_free_air_gradient() -> None:
    fall = gravity.normal_gravity(45, 1000) - gravity.normal_gravity(45)
    assert fall == pytest.approx(-3.085e-3, abs=2e-6)


def test_standard_gravity_is_the_one_of_1901() -> None:
    assert gravity.G0 == 9.80665


@pytest.mark.parametrize("place", [(-90, 0), (90, 0), (0, -1000), (0, 100_000)])
def test_the_poles_the_deepest_and_the_highest_place_count(
    place: tuple[float, float],
) -> None:
    assert 9.4 < gravity.normal_gravity(*place) < 9.9


@pytest.mark.parametrize(
    "place", [(-90.1, 0), (90.5, 0), (0, -1000.5), (0, 100_000.5), (95, 2e6)]
)
def test_a_place_that_is_none_is_refused_with_its_bounds(
    place: tuple[float, float],
) -> None:
    with pytest.raises(InputError) as told:
        gravity.normal_gravity(*place)
    assert str(told.value) == (
        f"no gravity for latitude {place[0]}° and height {place[1]} m: "
        "latitude is -90 to 90°, height -1000 to 100000 m"
    )


def test_examples() -> None:
    failed, tried = doctest.testmod(gravity)
    assert tried and not failed
