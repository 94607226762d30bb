"""What is found, in sentences."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from fieldcal.diagnosis.findings.unknown_mismatch import UnknownMismatch
from fieldcal.diagnosis.result import Mismatch, Quality, Quantity
from fieldcal.diagnosis.wording.paragraph import paragraph, with_uncertainty

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


def test_what_nothing_explains_is_told_by_place_with_its_outputs() -> None:
    """Not what a named effect explains, nor one place once for each output."""

    def off(channel: str, *positions: int, until: float = 90.0) -> Mismatch:
        return Mismatch(channel, "position", positions, 4.04, until, "time", 1e-3, 9.0)

    unknown = [
        UnknownMismatch("time", off("gx", 0, 1, 2, 4)),
        UnknownMismatch("time", off("gz", 0, 1, 2, 4)),
        UnknownMismatch("window", off("ax", 6, until=9.96)),
    ]
    pushed, quality = off("ay", 3), Quality(0.0, 1.0, 0.0, {})
    says = paragraph(
        "unexplained", [], [pushed, *(u.mismatch for u in unknown)], unknown,
        (quality, quality, "m/s^2"), [],
    )  # fmt: skip
    first = says.split(". ")[0]
    assert first.endswith(
        "(gx and gz, positions 1 to 3, 5, at 4 to 90 s;"
        " ax, position 7, at 4.0 to 10.0 s)"
    )
