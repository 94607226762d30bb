"""Values with their uncertainty, as sentences say them."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from fieldcal.diagnosis.result import Quantity
from fieldcal.diagnosis.wording.paragraph import with_uncertainty

SIZES = st.floats(1e-12, 1e3)


@given(st.floats(-1e3, 1e3), SIZES)
def test_a_value_is_written_to_the_second_digit_of_its_uncertainty(
    value: float, sigma: float
) -> None:
    """Nothing that the uncertainty shows is lost, and nothing beyond it is told."""
    text = with_uncertainty(Quantity(value, sigma, "1"))
    said, uncertainty = map(float, text.split(" ± "))
    digit = 10.0 ** math.floor(math.log10(sigma))  # whole numbers from 10 on
    exact = 0.501 if sigma >= 10.0 else 0.0501 * digit
    assert abs(said - value) <= exact + 1e-15 * abs(value)
    assert abs(uncertainty - sigma) <= exact
    assert len(text.split(" ± ")[1]) <= 9
