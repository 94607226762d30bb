"""What a factory leaves: three shapes of a curve compared by what they add."""

from __future__ import annotations

import math
import re

import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.factory import FactoryErrors

G = 9.80665

NAMES = {
    "cross_coupling": "squareness",
    "quadratic": "quadratic",
    "g_sensitivity": "g_sensitivity",
}
LARGEST = {"cross_coupling": "1", "quadratic": "0.01", "g_sensitivity": "0.01"}


def test_a_device_is_perfect_unless_stated() -> None:
    perfect = FactoryErrors()
    assert set(perfect.by_effect.values()) == {0.0}
    assert perfect.warming_effect(True) == ("temperature_bias", (0.0,) * 6)
    assert perfect.warming_effect(False) == ("warm_up", (0.0,) * 6)


def test_each_effect_has_its_own_size() -> None:
    sizes = FactoryErrors(3e-4, 2e-5, 4e-6).by_effect
    assert sizes["cross_coupling"] == 3e-4
    assert sizes["quadratic"] == 2e-5
    assert sizes["g_sensitivity"] == 4e-6
    assert set(sizes) == {
        "cross_coupling", "quadratic", "scale_asymmetry", "cubic", "g_sensitivity"
    }  # fmt: skip


def test_the_shapes_of_a_curve_add_the_same_where_they_are_compared() -> None:
    """A kink K |f| and a square K2 f^2 at 1 g; a cube K3 f^3 and the square at 10 g."""
    sizes = FactoryErrors(quadratic=2e-5).by_effect
    at_one, at_ten = sizes["quadratic"] * G**2, sizes["quadratic"] * (10 * G) ** 2
    assert sizes["scale_asymmetry"] * G == pytest.approx(at_one)
    assert sizes["cubic"] * (10 * G) ** 3 == pytest.approx(at_ten)


def test_a_thermometer_leaves_coefficients_and_none_leaves_the_rise_they_make() -> None:
    left = FactoryErrors(acc_per_k=2e-3, gyr_per_k=5e-5, warming_k=8.0)
    effect, sizes = left.warming_effect(has_thermometer=True)
    assert effect == "temperature_bias"
    assert sizes == (2e-3, 2e-3, 2e-3, 5e-5, 5e-5, 5e-5)
    effect, sizes = left.warming_effect(has_thermometer=False)
    assert effect == "warm_up"
    assert sizes == pytest.approx([0.016] * 3 + [4e-4] * 3)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("size", [-1e-9, 1.0, 45.0, math.nan, math.inf])
def test_a_size_that_no_device_has_is_refused_by_its_name(
    name: str, size: float
) -> None:
    with pytest.raises(InputError) as told:
        FactoryErrors(**{name: size})
    assert str(told.value) == (
        f"{NAMES[name]} {size:g} is none: give the 1σ of a coefficient in SI units,"
        f" 0 or more and below {LARGEST[name]}"
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_bound_itself_is_refused_and_what_is_below_it_is_not(name: str) -> None:
    bound = float(LARGEST[name])
    with pytest.raises(InputError, match=re.escape(f"below {LARGEST[name]}")):
        FactoryErrors(**{name: bound})
    below = math.nextafter(bound, 0.0)
    assert FactoryErrors(**{name: below}).by_effect[name] == below


@pytest.mark.parametrize("name", ["acc_per_k", "gyr_per_k", "hysteresis", "warming_k"])
@pytest.mark.parametrize("size", [-1e-9, math.nan, math.inf])
def test_no_size_is_negative_or_without_end(name: str, size: float) -> None:
    with pytest.raises(InputError, match=rf"{name} {size:g} is none.*0 or more"):
        FactoryErrors(**{name: size})
